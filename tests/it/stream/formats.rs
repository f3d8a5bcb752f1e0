//! Readers of the program.

mod arrays;
mod columnar;
mod publishers;
mod stores;
