//! The `teachtree` command.

fn main() -> std::process::ExitCode {
    teachtree::cli::main()
}
