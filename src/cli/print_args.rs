//! The options of all commands: what is printed besides results, and in color or not.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// Options of all commands.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct PrintArgs {
    /// Print results and errors only, no progress, no warnings and no notes
    #[arg(long, short, global = true, help_heading = "Options of all commands")]
    quiet: bool,
    /// When to print in color
    #[arg(
        long,
        value_enum,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        help_heading = "Options of all commands"
    )]
    color: ColorMode,
}

/// When to print in color.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ColorMode {
    /// On a terminal, unless `NO_COLOR` is set or `TERM` is `dumb`
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

static QUIET: AtomicBool = AtomicBool::new(false);
static COLOR: AtomicU8 = AtomicU8::new(ColorMode::Auto as u8);

impl PrintArgs {
    /// Applies the options to all that is printed from now on.
    pub fn apply(self) {
        QUIET.store(self.quiet, Ordering::Relaxed);
        COLOR.store(self.color as u8, Ordering::Relaxed);
    }
}

/// Whether only results and errors are printed.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// When to print in color.
pub fn color_mode() -> ColorMode {
    match COLOR.load(Ordering::Relaxed) {
        mode if mode == ColorMode::Always as u8 => ColorMode::Always,
        mode if mode == ColorMode::Never as u8 => ColorMode::Never,
        _ => ColorMode::Auto,
    }
}
