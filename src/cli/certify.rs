//! `teachtree certify`: how much a real cell may differ from the scene while a robot program succeeds.

use super::output_args::FormatArg;
use super::parallel::ParallelArgs;
use super::robot_program::{FailOn, Program, ProgramArgs};
use super::{Failure, output};
use clap::builder::PossibleValuesParser;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_frames::OpenRequest;
use teachtree_logs::read::csv;
use teachtree_robot::certificate::{
    CellQuantity, Certificate, CertificationFailure, Limits, QUANTITIES, Stop, certify,
};
use teachtree_robot::simulation::{CellVariation, Extent, Fault, FaultKind, Performance, simulate_within};
use teachtree_robot_report::certificate::{CertificateDocument, failure_picture};
use teachtree_session::{Log, LogInternals};

/// Options of `certify`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  teachtree certify commands.json --robot both_hands --scene pick_and_place
  teachtree certify commands.json --scene pick_and_place --vary friction,mass,pose_delay --report certificate.html

Exit status: 0 a box is certified; 1 the commands are refused, or no box is certified within --runs; 2 bad input; with the cell of the scene itself, the first of the faults that --fail-on names: 4 not done, 5 collisions, 6 not recognized, 7 forces outside of their profile.")]
pub struct Args {
    #[command(flatten)]
    program: ProgramArgs,
    /// The quantities that are varied; by default all but the constant errors of measured poses, `pose_error_x` to `pose_error_z`
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(QUANTITIES.iter().map(|quantity| quantity.name)))]
    vary: Vec<String>,
    /// Maximum number of runs
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: u32,
    /// Seed of the drawn cells
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Maximum number of runs in parallel; by default the number of cores
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Output file of a page with the box, and a picture of the first failure beyond each face
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of a certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Lines for the terminal
    Text,
    /// `teachtree.certificate/1`
    Json,
}

/// Runs `certify`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let program = args.program.open()?;
    args.report.iter().try_for_each(|place| output::refuse_inputs(place, &program.inputs))?;
    program.refuse_infeasible()?;
    let is_varied = |quantity: &&CellQuantity| {
        args.vary.is_empty() && quantity.usual || args.vary.iter().any(|name| name == quantity.name)
    };
    let quantities: Vec<&'static CellQuantity> = QUANTITIES.iter().filter(is_varied).collect();
    let cell = CellRuns { program: &program, fail_on: &args.program.fail_on };
    let jobs = ParallelArgs { jobs: args.jobs };
    let mut done = 0;
    let mut runs = |stage: &str, cells: &[CellVariation]| {
        let label = format!("{stage}: run {} to {}", done + 1, done + cells.len());
        done += cells.len();
        jobs.each(&label, cells, |variation| cell.fault(variation))?.into_iter().collect::<Result<Vec<_>, Failure>>()
    };
    let limits = Limits { seed: args.seed, runs: args.runs as usize };
    let result = certify(&quantities, limits, &mut runs)?;
    if let Err(CertificationFailure::Nominal(fault)) = &result
        && fault.kind == FaultKind::Refused
    {
        return Err(program.in_its_files(InputError::new("", fault.text.clone())).into());
    }
    let document =
        CertificateDocument { commands: &program.commands, quantities: &quantities, seed: args.seed, result };
    if let Some(place) = &args.report {
        let stops: Vec<&Stop> =
            document.result.iter().flat_map(|it| &it.faces).filter_map(|face| face.stop.as_ref()).collect();
        let picture = |stop: &&Stop| {
            cell.perform(&stop.cell).map(|performed| failure_picture(&program.commands, &performed, &stop.fault))
        };
        let pictures = jobs.each("pictures", &stops, picture)?.into_iter().map(|picture| picture.unwrap_or_default());
        output::write(place, &document.page(&pictures.collect::<Vec<String>>()), &program.inputs)?;
    }
    match args.form.format {
        Format::Text => output::print(&document.text())?,
        Format::Json => output::print_json(&document.json())?,
    }
    match document.result {
        Ok(Certificate { .. }) => Ok(()),
        Err(CertificationFailure::Runs(_)) => Err(Failure::Negative),
        Err(CertificationFailure::Nominal(fault)) => Err(FailOn::ALL
            .into_iter()
            .find(|kind| kind.kind() == fault.kind)
            .map_or(Failure::Negative, |kind| Failure::Fault(kind.status()))),
    }
}

/// Runs a program in varied cells.
struct CellRuns<'p> {
    program: &'p Program,
    fail_on: &'p [FailOn],
}

impl CellRuns<'_> {
    /// Simulates the program in a cell until it has failed.
    fn perform(&self, variation: &CellVariation) -> Result<Performance, InputError> {
        let counts = |kind| self.fail_on.contains(&kind);
        let extent = match (counts(FailOn::NotDone), counts(FailOn::Collisions)) {
            (true, true) => Extent::UntilFault,
            (true, false) => Extent::UntilNotDone,
            (false, _) => Extent::Whole,
        };
        let Program { commands, robot, scene, .. } = self.program;
        simulate_within(commands, robot, scene, variation, extent, &mut |_| {})
    }

    /// Returns the fault of the program in a cell; `None` for a success.
    fn fault(&self, variation: &CellVariation) -> Result<Option<Fault>, Failure> {
        let performed = match self.perform(variation) {
            Ok(performed) => performed,
            Err(InputError { place, message, .. }) => {
                return Ok(Some(Fault::new(FaultKind::Refused, format!("{place}: {message}"))));
            }
        };
        // A collision may have ended the simulation before the object was in its place.
        let kinds = [FailOn::Collisions, FailOn::NotDone, FailOn::Forces];
        let counting = kinds.into_iter().filter(|kind| self.fail_on.contains(kind));
        let first = counting.filter_map(|kind| Fault::first(kind.kind(), &performed)).next();
        if first.is_some() || !self.program.has_rules || !self.fail_on.contains(&FailOn::NotRecognized) {
            return Ok(first);
        }
        let log = Path::new("robot.csv");
        let request = OpenRequest { log: log.to_path_buf(), ..OpenRequest::default() };
        let opened = Log::open_source(csv::source(&performed.recording, log)?, &request)?;
        let recognized = self.program.recognized(&self.program.analysis.analyze(&opened)?);
        let missing = self.program.commands.tasks.iter().zip(recognized).filter(|(_, found)| *found == Some(false));
        let missing: Vec<String> = missing.map(|(task, _)| format!("{} {}", task.track, task.task)).collect();
        let text = format!("not recognized in the robot's recording: {}", missing.join(", "));
        Ok((!missing.is_empty()).then(|| Fault::new(FaultKind::NotRecognized, text)))
    }
}
