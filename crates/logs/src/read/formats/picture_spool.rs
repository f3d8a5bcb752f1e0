//! Pictures of a bag in a temporary file: a recording has more of them than fit in memory.

use std::fs::File;
use std::io::{Error, Read as _, Seek as _, SeekFrom, Write as _};
use teachtree_base::error::InputError;

/// A temporary file, deleted when the program ends.
pub struct PictureSpool {
    file: File,
    length: u64,
}

/// The location of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpooledPicture {
    start: u64,
    length: u64,
    /// Height, width and number of colors.
    pub size: [usize; 3],
}

impl PictureSpool {
    /// An empty file in the folder for temporary files.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn new() -> Result<Self, InputError> {
        Ok(Self { file: tempfile::tempfile().map_err(|error| failed(&error))?, length: 0 })
    }

    /// Adds the file of a picture of this size.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn add(&mut self, picture: &[u8], size: [usize; 3]) -> Result<SpooledPicture, InputError> {
        self.file.write_all(picture).map_err(|error| failed(&error))?;
        let place = SpooledPicture { start: self.length, length: picture.len() as u64, size };
        self.length += place.length;
        Ok(place)
    }

    /// Reads the file of a picture. None can be added from then on.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read(&mut self, place: SpooledPicture) -> Result<Vec<u8>, InputError> {
        let mut bytes = vec![0; usize::try_from(place.length).unwrap_or(0)];
        let mut read = || {
            self.file.seek(SeekFrom::Start(place.start))?;
            self.file.read_exact(&mut bytes)
        };
        read().map_err(|error| failed(&error))?;
        Ok(bytes)
    }
}

fn failed(error: &Error) -> InputError {
    InputError::new("the temporary file of pictures", error.to_string())
        .help("make room there, or set TMPDIR to a folder with more")
}
