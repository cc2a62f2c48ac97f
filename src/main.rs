//! The `strandline` program: everything it does lives in the library.

fn main() -> std::process::ExitCode {
    strandline::cli::run(std::env::args_os())
}
