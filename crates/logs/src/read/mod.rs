//! Read: a path in, raw columns with their stamps out. Nothing here knows what a column means to a rule.

pub mod csv;
pub mod date_time;
pub mod element_names;
pub mod file;
pub mod first_stamp;
pub mod formats;
pub mod labels;
pub mod memory_table;
pub mod progress;
pub mod stamp_order;
pub mod table;
pub mod text;
mod topic_clocks;
