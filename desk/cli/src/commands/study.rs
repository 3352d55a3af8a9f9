//! `softgrip study`: the paper's twelve runs, and a report.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use report::{files, words};
use serde_json::Value;
use sim::setup::Setup;
use studies::paper;
use studies::study::{self, Case, page};

use super::output;
use super::output::outln;
use super::{Castings, Controls, Output, in_parallel, load_recipe, progress_bar};

#[derive(Args)]
pub struct StudyArgs {
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    castings: Castings,
    #[command(flatten)]
    output: Output,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub fn run(args: &StudyArgs) -> anyhow::Result<ExitCode> {
    let out = args.output.directory()?;
    in_parallel(args.jobs, || study(args, out))?
}

fn study(args: &StudyArgs, out: Option<&Path>) -> anyhow::Result<ExitCode> {
    let recipe = load_recipe(args.recipe.as_deref())?;
    let programme = (paper::EXPERIMENTS.len() * paper::ACCELERATIONS.len()) as u64;
    let more = out.map_or(0, |_| study::SENSITIVITY_RUNS);
    let bar = progress_bar(programme + more, "runs");
    let start = Instant::now();
    let mut base = Setup::with_castings(&recipe, args.castings.finger_seed)?;
    args.controls.apply(&mut base)?;
    let cases = study::run(&base, || bar.inc(1))?;
    let took = start.elapsed().as_secs_f64();
    let list = Value::from_iter(cases.iter().map(Case::json));
    if let Some(dir) = out {
        let varied = study::sensitivity(&base, || bar.inc(1))?;
        let edges = (0..cases.len()).filter(|&n| !study::robust(&cases, &varied, n));
        let bands = edges
            .map(|n| Ok((n, study::bands(&base, n)?)))
            .collect::<anyhow::Result<Vec<_>>>()?;
        let page = page::report(&page::StudyPage {
            recipe: &recipe,
            cases: &cases,
            varied: &varied,
            bands: &bands,
        })?;
        let sensitivity = study::sensitivity_json(&cases, &varied);
        files::write(dir, "study.json", format!("{list}\n").as_bytes())?;
        files::write(
            dir,
            "sensitivity.json",
            format!("{sensitivity}\n").as_bytes(),
        )?;
        files::write(dir, "report.html", page.as_bytes())?;
    }
    bar.finish_and_clear();
    if args.output.json {
        outln!("{list}");
    } else {
        for case in &cases {
            outln!("{}", line(case));
        }
        let stated = cases.iter().filter(|case| case.agrees().is_some()).count();
        let agreeing = cases
            .iter()
            .filter(|case| case.agrees() == Some(true))
            .count();
        outln!("{agreeing} of {stated} stated outcomes; {programme} runs in {took:.1} s");
    }
    if let (Some(dir), false) = (out, args.output.json) {
        outln!("report: {}/report.html", dir.display());
    }
    let mistakes: Vec<String> = cases
        .iter()
        .filter_map(|case| {
            Some(format!(
                "{}: {}",
                words::title(&case.run.scenario),
                case.run.mistake()?
            ))
        })
        .collect();
    for mistake in &mistakes {
        output::note(format_args!("{mistake}"));
    }
    Ok(ExitCode::from(u8::from(!mistakes.is_empty())))
}

fn line(case: &Case) -> String {
    let said = match (case.run.flagged_at_s, case.run.latency_ms()) {
        (None, _) => "no loss reported".to_string(),
        (Some(t), None) => format!("lost at {t:.3} s"),
        (Some(t), Some(ms)) => format!("lost at {t:.3} s, {}", words::latency(ms)),
    };
    format!(
        "{:<32} paper: {:<9} simulated: {:<9} {:<8} {said}",
        words::title(&case.run.scenario),
        case.stated.name(),
        case.run.outcome.name(),
        match case.agrees() {
            Some(true) => "agrees",
            Some(false) => "DIFFERS",
            None => "",
        },
    )
}
