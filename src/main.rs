//! The `riprap` command: arguments in, exit code out.

/// Contacts are spread over many small pieces of memory; by the system's allocator a tenth more time goes into fetching them.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    riprap::cli::main()
}
