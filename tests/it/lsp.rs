//! The language server, driven over its protocol as an editor drives it: the real program, its standard input and output.

mod answers;
mod editor;
mod names;
mod robust;
