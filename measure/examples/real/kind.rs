//! Kinds of recordings: what tells them from each other, which binding reads them, and whose they are.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

/// A kind of recordings, all read by one binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    SawyerNuts,
    PandaNuts,
    SawyerStack,
    PandaStack,
    SawyerLift,
    PandaLift,
    SawyerPickPlace,
    Door,
    Wipe,
    HandOver,
    BaxterLift,
    BaxterPeg,
    Desk,
    Wiping,
    Peeling,
    Snap,
    Latch,
}

/// What a kind belongs to: kinds of one set are counted together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Set {
    OneArm,
    Lever,
    Wipe,
    HandOver,
    LiftTogether,
    PegInHole,
    Desk,
    Wiping,
    Peeling,
    Snap,
    Latch,
}

impl Kind {
    /// The binding, in `demos`.
    pub const fn binding(self) -> &'static str {
        match self {
            Self::SawyerNuts => "robosuite/sawyer_nut_assembly",
            Self::PandaNuts => "robosuite/panda_nut_assembly",
            Self::SawyerStack => "robosuite/sawyer_stack",
            Self::PandaStack => "robosuite/panda_stack",
            Self::SawyerLift => "robosuite/sawyer_lift",
            Self::PandaLift => "robosuite/panda_lift",
            Self::SawyerPickPlace => "robosuite/sawyer_pick_place",
            Self::Door => "robosuite/door",
            Self::Wipe => "robosuite/wipe",
            Self::HandOver => "robosuite/handover",
            Self::BaxterLift => "robosuite/baxter_lift",
            Self::BaxterPeg => "robosuite/baxter_peg_in_hole",
            Self::Desk => "bindings/desk_yumi",
            Self::Wiping => "bindings/icsc_wiping",
            Self::Peeling => "bindings/icsc_peeling",
            Self::Snap => "bindings/hiro_snap",
            Self::Latch => "bindings/dapg_door",
        }
    }

    pub const fn set(self) -> Set {
        match self {
            Self::SawyerNuts
            | Self::PandaNuts
            | Self::SawyerStack
            | Self::PandaStack
            | Self::SawyerLift
            | Self::PandaLift
            | Self::SawyerPickPlace => Set::OneArm,
            Self::Door => Set::Lever,
            Self::Wipe => Set::Wipe,
            Self::HandOver => Set::HandOver,
            Self::BaxterLift => Set::LiftTogether,
            Self::BaxterPeg => Set::PegInHole,
            Self::Desk => Set::Desk,
            Self::Wiping => Set::Wiping,
            Self::Peeling => Set::Peeling,
            Self::Snap => Set::Snap,
            Self::Latch => Set::Latch,
        }
    }

    /// What kind a log is, by the titles of its columns.
    fn of(path: &Path) -> Option<Self> {
        if path.join("R_Torques.dat").is_file() {
            return Some(Self::Snap);
        }
        if path.extension().is_none_or(|ending| ending != "csv") {
            return None;
        }
        let mut line = String::new();
        BufReader::new(std::fs::File::open(path).ok()?).read_line(&mut line).ok()?;
        let titles: Vec<&str> = line.trim().split(',').collect();
        // The two arms that did the same tasks have bindings of their own.
        let sawyer = path.file_name().is_some_and(|name| name.to_string_lossy().contains("Sawyer"));
        let arm = |one: Self, other: Self| if sawyer { one } else { other };
        let kinds: [(&[&str], Self); 13] = [
            (&["SquareNut0_px"], arm(Self::SawyerNuts, Self::PandaNuts)),
            (&["cubeA_px"], arm(Self::SawyerStack, Self::PandaStack)),
            (&["cube_px"], arm(Self::SawyerLift, Self::PandaLift)),
            (&["Milk0_px"], Self::SawyerPickPlace),
            (&["latch_px"], Self::Door),
            (&["hammer_px"], Self::HandOver),
            (&["pot_px"], Self::BaxterLift),
            (&["cylinder_px"], Self::BaxterPeg),
            (&["F_R_hand_env_x"], Self::Wipe),
            (&["L_closed", "surgeme"], Self::Desk),
            (&["a_px", "p_px", "label"], Self::Peeling),
            (&["fx", "vx", "label"], Self::Wiping),
            (&["latch_rad"], Self::Latch),
        ];
        kinds.into_iter().find(|(columns, _)| columns.iter().all(|title| titles.contains(title))).map(|(_, kind)| kind)
    }
}

impl Set {
    /// Whose it is, and its licence.
    pub const fn about(self) -> (&'static str, &'static str) {
        match self {
            Self::OneArm => ("robosuite, one arm", "MIT"),
            Self::Lever => ("robosuite door", "MIT"),
            Self::Wipe => ("robosuite wipe", "MIT"),
            Self::HandOver => ("robosuite hand-over", "MIT"),
            Self::LiftTogether => ("robosuite BaxterLift", "MIT"),
            Self::PegInHole => ("robosuite BaxterPegInHole", "MIT"),
            Self::Desk => ("DESK peg transfer", "MIT"),
            Self::Wiping => ("ICSC-HMM wiping", "SimPL-2.0"),
            Self::Peeling => ("ICSC-HMM peeling", "SimPL-2.0"),
            Self::Snap => ("HIRO snap assembly", "ODbL"),
            Self::Latch => ("DAPG door", "Apache-2.0"),
        }
    }
}

/// All recordings below a folder, by path.
pub fn recordings(folder: &Path, found: &mut Vec<(Kind, PathBuf)>) -> Result<(), String> {
    if let Some(kind) = Kind::of(folder) {
        found.push((kind, folder.to_path_buf()));
        return Ok(());
    }
    if !folder.is_dir() {
        return if folder.exists() { Ok(()) } else { Err(format!("{}: no such folder", folder.display())) };
    }
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    paths.iter().try_for_each(|path| recordings(path, found))
}
