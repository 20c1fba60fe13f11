//! The `riprap` command: arguments in, exit code out.

fn main() -> std::process::ExitCode {
    riprap::cli::main()
}
