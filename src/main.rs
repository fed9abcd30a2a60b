//! The command line.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod cli;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// One mesh for every face: registers collections of 3D face scans onto one shared triangle mesh.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    threads: cli::Threads,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Register(cli::Register),
    Submit(cli::Submit),
    Fit(cli::Fit),
    Invert(cli::Invert),
    Capture(cli::Capture),
    Evaluate(cli::Evaluate),
    Inspect(cli::Inspect),
    Audit(cli::Audit),
    Demo(cli::Demo),
    Bench(cli::Bench),
    Serve(cli::Serve),
    Key(cli::Key),
    Openapi(cli::Openapi),
    Health(cli::Health),
    Doctor(cli::Doctor),
}

fn main() -> ExitCode {
    let Arguments { threads, command } = Arguments::parse();
    cli::finish(threads.apply().and_then(|()| match command {
        Command::Register(command) => command.run(),
        Command::Submit(command) => command.run(),
        Command::Fit(command) => command.run(),
        Command::Invert(command) => command.run(),
        Command::Capture(command) => command.run(),
        Command::Evaluate(command) => command.run(),
        Command::Inspect(command) => command.run(),
        Command::Audit(command) => command.run(),
        Command::Demo(command) => command.run(),
        Command::Bench(command) => command.run(),
        Command::Serve(command) => command.run(),
        Command::Key(command) => command.run(),
        Command::Openapi(command) => command.run(),
        Command::Health(command) => command.run(),
        Command::Doctor(command) => command.run(),
    }))
}
