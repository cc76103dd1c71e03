//! Command line of `outcrop`: parse, run, exit code.

fn main() -> std::process::ExitCode {
    outcrop::cli::main()
}
