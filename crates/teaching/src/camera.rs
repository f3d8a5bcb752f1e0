//! The program that finds hands in a camera's pictures: MediaPipe Hands, in the npm package `@mediapipe/hands`, which runs on the page.

use std::fs::File;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_serve::{Content, Response};

const SCRIPT: &str = "text/javascript; charset=utf-8";
const DATA: &str = "application/octet-stream";

/// The package, where it is installed.
pub struct HandFinder {
    folder: PathBuf,
}

impl HandFinder {
    /// The files that a page asks for, with their media types. A browser takes the one or the other program, and the page the better model.
    pub const FILES: [(&str, &str); 10] = [
        ("hands.js", SCRIPT),
        ("hands.binarypb", DATA),
        ("hand_landmark_full.tflite", DATA),
        ("hands_solution_packed_assets_loader.js", SCRIPT),
        ("hands_solution_packed_assets.data", DATA),
        ("hands_solution_simd_wasm_bin.js", SCRIPT),
        ("hands_solution_simd_wasm_bin.wasm", "application/wasm"),
        ("hands_solution_simd_wasm_bin.data", DATA),
        ("hands_solution_wasm_bin.js", SCRIPT),
        ("hands_solution_wasm_bin.wasm", "application/wasm"),
    ];

    /// The package in a folder.
    ///
    /// # Errors
    /// A folder that lacks one of its files.
    pub fn open(folder: &Path) -> Result<Self, InputError> {
        match Self::FILES.iter().find(|(name, _)| !folder.join(name).is_file()) {
            None => Ok(Self { folder: folder.into() }),
            Some((name, _)) => {
                let message = format!("is not the npm package @mediapipe/hands: it has no {name}");
                Err(InputError::new(folder.display().to_string(), message)
                    .help("`npm install @mediapipe/hands` makes it: node_modules/@mediapipe/hands"))
            }
        }
    }

    /// A file of the package; `None` for any other.
    pub fn file(&self, name: &str) -> Option<Response> {
        let (name, kind) = Self::FILES.into_iter().find(|(known, _)| *known == name)?;
        let file = File::open(self.folder.join(name)).ok()?;
        Some(Response { status: 200, kind, content: Content::File(file) })
    }
}
