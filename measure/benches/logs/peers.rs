//! The peers of the comparison: arrow's column reader, and programs in Python.

use parquet::column::reader::ColumnReader;
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::io::{BufRead, BufReader, Lines, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

/// Decodes all numeric columns of a file into one vector each.
pub fn arrow_columns(path: &Path) -> Vec<Vec<f64>> {
    let reader = SerializedFileReader::new(File::open(path).expect("opens")).expect("is Parquet");
    let columns = reader.metadata().file_metadata().schema_descr().num_columns();
    let mut values: Vec<Vec<f64>> = vec![vec![]; columns];
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).expect("is there");
        let rows = usize::try_from(group.metadata().num_rows()).expect("not less than none");
        for (column, values) in values.iter_mut().enumerate() {
            if let ColumnReader::DoubleColumnReader(mut reader) = group.get_column_reader(column).expect("is there") {
                let mut left = rows;
                while left > 0 {
                    left -= reader.read_records(left, None, None, values).expect("is whole").0;
                }
            }
        }
    }
    values
}

/// A Python program that repeats its work for each line of input and answers with the time, s.
pub struct Python {
    child: Child,
    answers: Lines<BufReader<ChildStdout>>,
}

impl Python {
    /// Starts it with a file and runs its work once; `None` if it cannot run.
    pub fn new(script: &str, file: &Path) -> Option<Self> {
        let mut command = Command::new("python3");
        let piped = command.args(["-c", script]).arg(file).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = piped.stderr(Stdio::null()).spawn().ok()?;
        let answers = BufReader::new(child.stdout.take()?).lines();
        let mut python = Self { child, answers };
        python.ask().map(|_| python)
    }

    fn ask(&mut self) -> Option<f64> {
        self.child.stdin.as_mut()?.write_all(b"\n").ok()?;
        self.answers.next()?.ok()?.trim().parse().ok()
    }

    /// Runs the work once and returns the time, s.
    pub fn seconds(&mut self) -> f64 {
        self.ask().expect("it did so before")
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}
