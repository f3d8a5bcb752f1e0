//! Dates and times of day as other programs write them: ISO 8601, spreadsheets, data acquisition, loggers of Python.

use teachtree_base::error::InputError;

/// The forms that are read.
const FORMS: &str =
    "write dates as `2026-11-21 19:07:00.25`, times of day as `19:07:00.25` or `07:07:00.25 PM`, minutes as `07:00.25`";

/// Adds the forms that are read to the error about a text that is not a time, if it looks like one.
pub fn explained(error: InputError, text: &str) -> InputError {
    let looks_like = text.trim_start().starts_with(|first: char| first.is_ascii_digit()) && text.contains([':', '/']);
    if looks_like { error.help(FORMS) } else { error }
}

/// The abbreviated names of months.
const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];

const SECONDS_PER_DAY: f64 = 86_400.0;

/// Seconds since 1970 of a date and a time of day, `2026-11-21 19:07:00.25+01:00`, `21.11.2026 19:07:00,25` or `21-Nov-2026 07:07 PM`; since midnight of a time of
/// day alone; from the start of `3 days 00:01:02` and of minutes and seconds, `01:02.5`. `None` for another text, and for a date whose day and month are unclear.
pub fn date_time(text: &str) -> Option<f64> {
    let text = text.trim();
    // Most cells that are not numbers are words.
    if !text.starts_with(|first: char| first.is_ascii_digit()) || !text.contains(':') && !text.contains('T') {
        return None;
    }
    let (text, half) = half_of_day(text);
    let (date, clock) = parts(text);
    let days = match date {
        Some(date) => days_of_timedelta(date).or_else(|| days(date, half.is_some()))?,
        None => 0.0,
    };
    let (clock, zone) = zone(clock)?;
    let seconds = match date {
        Some(_) => of_day(clock, half)?,
        None if half.is_none() => minutes(clock).or_else(|| of_day(clock, half))?,
        None => of_day(clock, half)?,
    };
    Some(days * SECONDS_PER_DAY + seconds - zone)
}

/// The date and the time of day of a stamp since 1970, `2026-11-21 19:07:00`, in UTC.
pub fn written(stamp_s: f64) -> String {
    let seconds = stamp_s.round() as i64;
    let (day, second) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    // Years that begin in March have their leap day at the end; 400 of them are a cycle.
    let day = day + 719_468;
    let (cycle, day) = (day.div_euclid(146_097), day.rem_euclid(146_097));
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 { (year, month + 3) } else { (year + 1, month - 9) };
    let year = 400 * cycle + year;
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60)
}

/// The halves of a day of 12 hours.
#[derive(Clone, Copy, PartialEq)]
enum HalfOfDay {
    Am,
    Pm,
}

/// Splits `AM` or `PM` from the end of a text.
fn half_of_day(text: &str) -> (&str, Option<HalfOfDay>) {
    let split = |ending: &str| {
        let (text, end) = text.split_at_checked(text.len().checked_sub(ending.len())?)?;
        end.eq_ignore_ascii_case(ending).then(|| text.trim_end())
    };
    let endings = [("AM", HalfOfDay::Am), ("PM", HalfOfDay::Pm), ("a.m.", HalfOfDay::Am), ("p.m.", HalfOfDay::Pm)];
    let found = endings.into_iter().find_map(|(ending, half)| Some((split(ending)?, Some(half))));
    found.unwrap_or((text, None))
}

/// A date, if there is one, and the clock behind it.
fn parts(text: &str) -> (Option<&str>, &str) {
    // A date in words has blanks: the clock begins behind the last one before its first colon.
    let colon = text.find(':').unwrap_or(text.len());
    let head = text.get(..colon).unwrap_or_default();
    match head.rfind([' ', 'T', 't', '_']) {
        Some(at) => (Some(head.get(..at).unwrap_or_default().trim_end()), text.get(at + 1..).unwrap_or_default()),
        None => (None, text),
    }
}

/// The clock without its zone, and how far the zone is ahead of UTC, s.
fn zone(clock: &str) -> Option<(&str, f64)> {
    let utc = ["Z", "z", "UTC", "GMT"].into_iter().find_map(|name| clock.strip_suffix(name));
    if let Some(clock) = utc {
        return Some((clock.trim_end(), 0.0));
    }
    let Some((clock, zone)) = clock.rfind(['+', '-']).and_then(|at| clock.split_at_checked(at)) else {
        return Some((clock, 0.0));
    };
    let sign = if zone.starts_with('-') { -1.0 } else { 1.0 };
    let digits = zone.get(1..)?.replace(':', "");
    let (hours, minutes) = digits.split_at_checked(2)?;
    let number = |part: &str| if part.is_empty() { Some(0.0) } else { whole(part) };
    Some((clock.trim_end(), sign * (number(hours)? * 3600.0 + number(minutes)? * 60.0)))
}

/// Seconds of a time of day: `19:07`, `19:07:00.25`, `190700.25`.
fn of_day(clock: &str, half: Option<HalfOfDay>) -> Option<f64> {
    let parts: Vec<&str> = clock.trim().split(':').collect();
    let (hours, minutes, seconds) = match *parts.as_slice() {
        [hours, minutes] => (hours, minutes, "0"),
        [hours, minutes, seconds] => (hours, minutes, seconds),
        // ISO 8601 without colons.
        [digits] if half.is_none() => (digits.get(..2)?, digits.get(2..4)?, digits.get(4..)?),
        _ => return None,
    };
    let hours = match half {
        None => whole(hours)?,
        Some(half) => {
            let hour = whole(hours).filter(|hour| (1.0..=12.0).contains(hour))?;
            hour % 12.0 + if half == HalfOfDay::Pm { 12.0 } else { 0.0 }
        }
    };
    Some(hours * 3600.0 + whole(minutes)? * 60.0 + fraction(seconds)?)
}

/// Seconds of minutes and seconds. Stamps are at most a second apart, so two numbers are not hours and minutes.
fn minutes(clock: &str) -> Option<f64> {
    let (minutes, seconds) = clock.split_once(':')?;
    Some(whole(minutes)? * 60.0 + fraction(seconds)?)
}

/// A number of digits alone.
fn whole(text: &str) -> Option<f64> {
    let is_whole = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if is_whole { text.parse().ok() } else { None }
}

/// A number with a decimal point or comma.
fn fraction(text: &str) -> Option<f64> {
    let (seconds, digits) = text.split_once(['.', ',']).unwrap_or((text, "0"));
    whole(seconds)?;
    whole(digits)?;
    text.replace(',', ".").parse().ok()
}

/// The days of `3 days` or `1 day,`, as Python writes durations.
fn days_of_timedelta(text: &str) -> Option<f64> {
    let (days, word) = text.split_once(' ')?;
    if matches!(word.trim_end_matches(','), "day" | "days") { whole(days) } else { None }
}

/// Days from 1970-01-01 to a date of the Gregorian calendar: `2026-11-21`, `2026/11/21`, `20261121`, `21.11.2026`, `11/21/2026`, `21-Nov-2026`. Without dots, the
/// month comes first where `is_american` or no other reading is possible.
fn days(date: &str, is_american: bool) -> Option<f64> {
    if date.len() == 8 && whole(date).is_some() {
        let number = |part: &str| part.parse::<i64>().ok();
        return day_number(number(date.get(..4)?)?, number(date.get(4..6)?)?, number(date.get(6..)?)?);
    }
    let parts: Vec<&str> = date.split(['-', '/', '.', ' ', ',']).filter(|part| !part.is_empty()).collect();
    let [first, second, third] = *parts.as_slice() else { return None };
    let number = |part: &str| whole(part).map(|number| number as i64);
    let month_of = |name: &str| {
        let name = name.get(..3)?.to_ascii_lowercase();
        MONTHS.iter().position(|month| *month == name).map(|month| month as i64 + 1)
    };
    if let Some(month) = month_of(second).filter(|_| number(second).is_none()) {
        let (day, year) = if first.len() == 4 { (third, first) } else { (first, third) };
        return day_number(number(year)?, month, number(day)?);
    }
    let (one, two, three) = (number(first)?, number(second)?, number(third)?);
    if first.len() == 4 {
        return day_number(one, two, three);
    }
    if third.len() != 4 {
        return None;
    }
    match (date.contains('.'), one > 12, two > 12) {
        (true, ..) | (false, true, false) => day_number(three, two, one),
        (false, false, true) => day_number(three, one, two),
        (false, false, false) if is_american => day_number(three, one, two),
        // 03/04/2026 is the third of April or the fourth of March.
        _ => None,
    }
}

/// Days from 1970-01-01 to a year, a month and a day of the Gregorian calendar.
fn day_number(year: i64, month: i64, day: i64) -> Option<f64> {
    if !((1..=9999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day)) {
        return None;
    }
    // Years that begin in March have their leap day at the end.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    Some((365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 719_469) as f64)
}
