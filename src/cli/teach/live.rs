//! `teachtree teach SCENE --live`: a person moves the hands, on a page of this machine or another one.

use super::remote_options::RemoteArgs;
use super::{Args, stem};
use crate::cli::retarget::{open_robot, touch_forces};
use crate::cli::rules::RuleArgs;
use crate::cli::source::{in_scene, is_yaml};
use crate::cli::{Failure, browser, on_interrupt, output};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use teachtree_base::error::InputError;
use teachtree_command as command;
use teachtree_logs::atomic_write;
use teachtree_robot::simulation::{Verdict, simulate};
use teachtree_robot::{self as robot, Robot};
use teachtree_robot_report::{format_performance, page};
use teachtree_serve::Server;
use teachtree_session::{AnalysisInternals, LogInternals};
use teachtree_session::{Log, RulesOptions};
use teachtree_teaching::{self as teaching, HandFinder, Options, Punctuality, RobotResult, Teaching, TeachingPage};

/// Who performs what was taught.
const ROBOT: &str = "both_hands";
/// How long the end waits for a recording that is being written, in tenths of a second.
const LAST_WAIT: usize = 600;

/// Options of `teach --live`.
#[derive(clap::Args)]
pub struct LiveArgs {
    /// Teach by hand: open a local page on which you move the hands (docs/teaching.md)
    #[arg(long, conflicts_with_all = ["operator", "seed", "seeds", "variation"])]
    pub live: bool,
    /// With --live: the port of the page; by default any free port
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// With --live: print the address without opening a browser
    #[arg(long)]
    no_open: bool,
    /// With --live: rule files that label the recording; by default the shipped ones
    #[arg(long = "rules", value_name = "FILE")]
    rules: Vec<PathBuf>,
    /// With --live: the folder of the npm package @mediapipe/hands; the page then tracks your hands with a camera
    #[arg(long, value_name = "FOLDER")]
    camera: Option<PathBuf>,
    /// With --live: the public address of a proxy on this machine that serves the page with TLS, such as https://teach.example.org
    #[arg(long, value_name = "ORIGIN", value_parser = origin, conflicts_with = "host")]
    behind: Option<String>,
    #[command(flatten)]
    others: RemoteArgs,
}

impl LiveArgs {
    /// Refuses options of `--live` where it is not given: clap does not where an operator conflicts with it.
    ///
    /// # Errors
    /// When there are some.
    pub fn check(&self) -> Result<(), InputError> {
        let given = [
            ("--port", self.port.is_some()),
            ("--no-open", self.no_open),
            ("--rules", !self.rules.is_empty()),
            ("--camera", self.camera.is_some()),
            ("--behind", self.behind.is_some()),
            ("--host", self.others.is_given()),
        ];
        match given.into_iter().find(|(_, is_given)| *is_given && !self.live) {
            Some((name, _)) => Err(InputError::new(name, "is an option of --live, which was not given")),
            None => Ok(()),
        }
    }
}

/// The origin of a proxy.
fn origin(text: &str) -> Result<String, String> {
    // As browsers send it: small letters, without the usual port.
    let lower = text.to_ascii_lowercase();
    let host = lower.strip_prefix("https://").map(|host| host.trim_end_matches('/').trim_end_matches(":443"));
    let is_host = |host: &&str| !host.is_empty() && !host.contains(['/', '?', '#', '@', ' ']);
    let host = host.filter(is_host).ok_or("expected https:// and a host, such as https://teach.example.org")?;
    Ok(format!("https://{host}"))
}

/// Runs `teach --live`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let scene = super::open_scene(&args.scene)?;
    let mut inputs: Vec<PathBuf> = is_yaml(&args.scene).then(|| PathBuf::from(&args.scene)).into_iter().collect();
    inputs.extend(args.live.rules.iter().chain(args.live.others.files()).cloned());
    let (robot, parts) = open_robot(args.robot.as_deref().unwrap_or(ROBOT))?;
    inputs.extend(parts);
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.csv", stem(&args.scene))));
    output::may_record(&out, &inputs)?;
    let port = args.live.port.unwrap_or(0);
    let (server, proof) = match args.live.others.server(port)? {
        Some((server, proof)) => (server, format!("{proof}\n")),
        None => (Server::new(port)?.behind(args.live.behind.clone()), String::new()),
    };
    let rules = RuleArgs::of_files(&args.live.rules, None).options();
    let options = Options {
        name: scene.name.clone(),
        scene,
        out,
        inputs,
        rules: rules.clone(),
        camera: args.live.camera.as_deref().map(HandFinder::open).transpose()?,
        perform: Box::new(move |file, progress| perform(file, &rules, &robot, progress)),
    };
    let (teaching, ended) = teaching::begin(options).map_err(|error| in_scene(&args.scene, error))?;
    output::print(&format!("{}\nteach on this page; Ctrl-C ends it\n{proof}", server.address()))?;
    on_interrupt({
        let teaching = Arc::clone(&teaching);
        move || {
            teaching.stop();
            let punctuality = ended.recv().unwrap_or_default();
            let waits = (0..LAST_WAIT).take_while(|_| teaching.is_writing());
            waits.for_each(|_| std::thread::sleep(Duration::from_millis(100)));
            // The reader of the output may be gone.
            let _ = output::print(&format_summary(&teaching, &punctuality));
            let lost = teaching.is_writing() || !teaching.troubles().is_empty();
            let _nothing_is_written = atomic_write::abort_writes();
            std::process::exit(i32::from(lost));
        }
    });
    if !args.live.no_open {
        browser::open(&server.address());
    }
    server.run(&Arc::new(TeachingPage(teaching)));
    Ok(())
}

/// What was recorded, and how punctual the servo was.
fn format_summary(teaching: &Teaching, punctuality: &Punctuality) -> String {
    let mut text = String::new();
    for file in teaching.files() {
        text.push_str(&format!("written: {}\n", file.display()));
    }
    for trouble in teaching.troubles() {
        text.push_str(&format!("{trouble}\n"));
    }
    if teaching.is_writing() {
        text.push_str("a recording that was being written is lost: it took too long\n");
    }
    text.push_str(&format!(
        "servo: {} steps of 1 ms, {:.2} % within 1 ms of their time; 99.9 % within {:.2} ms, the latest {:.1} ms late\n",
        punctuality.steps,
        punctuality.share() * 100.0,
        punctuality.within_us(0.999) as f64 / 1e3,
        punctuality.latest_us as f64 / 1e3
    ));
    if punctuality.given_up_ms > 0 {
        text.push_str(&format!("the machine was {} ms behind, which were given up\n", punctuality.given_up_ms));
    }
    text
}

/// Lets the robot perform a recording: as `retarget` and `simulate` do it.
fn perform(
    file: &Path,
    rules: &RulesOptions,
    robot: &Robot,
    progress: &mut dyn FnMut(f64),
) -> Result<RobotResult, String> {
    let in_words = |error: &dyn std::fmt::Display| error.to_string();
    let log = Log::open(file).map_err(|error| in_words(&error))?;
    let rules = rules.clone().without_failures().for_log(&log).map_err(|error| in_words(&error))?;
    let analysis = rules.analyze(&log).map_err(|error| in_words(&error))?;
    let opened = log.opened().map_err(|error| in_words(&error))?;
    let trusted = opened.trusted().map_err(|error: InputError| in_words(&error))?;
    let scene = &opened.recording.scene;
    let mut commands = command::commands(&trusted, analysis.found(), touch_forces(&rules), &log.name())
        .map_err(|error| in_words(&error))?;
    if commands.tasks.is_empty() {
        return Err("no task was found with an object that fingers touch: there is nothing to perform".into());
    }
    robot::map(&mut commands, robot, scene).map_err(|error| in_words(&error))?;
    let infeasible = commands.tasks.iter().flat_map(|task| &task.grasps).find_map(|grasp| grasp.infeasible.as_ref());
    if let Some(why) = infeasible {
        return Err(format!("the robot's hand cannot take the grasp: {why}"));
    }
    let performed = simulate(&commands, robot, scene, progress).map_err(|error| in_words(&error))?;
    Ok(RobotResult {
        text: format_performance(&performed),
        done: performed.outcomes.iter().all(|outcome| outcome.verdict() == Verdict::Done),
        page: page(&commands, &performed),
        recording: performed.recording,
    })
}
