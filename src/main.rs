//! The `teachtree` command.

fn main() -> std::process::ExitCode {
    teachtree::command_line()
}
