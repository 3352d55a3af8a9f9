//! The study's figures, numbered as in the paper.

use finger::capability::GRAVITY_M_S2;
use finger::chain::Chain;
use finger::recipe::Recipe;
use maud::{Markup, html};
use plotters::prelude::SeriesLabelPosition;
use plotters::style::RGBColor;
use report::charts::{self, Look, Panel, Series, color};
use report::style::QUIET;
use report::words;
use sim::arm::Phase;
use sim::run::{Outcome, Run, Sample};
use sim::scenario::{ObjectKind, Scenario};
use sim::setup::Setup;
use softgrip::FINGERS;

use super::Case;
use crate::paper::EXPERIMENTS;
use crate::{capability, paper};

/// A figure of the page.
pub struct Figure {
    /// Title, with the figure's number in the paper.
    pub title: String,
    /// The chart as SVG.
    pub svg: String,
    /// Explanation below the chart.
    pub caption: Markup,
}

const WIDTH: u32 = 960;
/// Every n-th sample is drawn: 250 Hz is finer than the resolution of the figure.
const EVERY: usize = 4;

/// All of them, in the order of the paper.
///
/// # Errors
/// If the drawing library fails.
pub fn all(recipe: &Recipe, cases: &[Case]) -> anyhow::Result<Vec<Figure>> {
    let published = paper::recipe()?.chain;
    let mut figures = vec![
        tip_angle(&recipe.chain, &published)?,
        deflection(&recipe.chain, &published)?,
    ];
    let per_object = cases.len() / EXPERIMENTS.len();
    for cases in cases.chunks(per_object) {
        figures.push(displacement(cases)?);
    }
    for cases in cases.chunks(per_object) {
        figures.push(strain(cases)?);
    }
    figures.push(summary(recipe, cases)?);
    Ok(figures)
}

fn line(name: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.into(),
        look: Look::Line,
        color,
        points,
    }
}

fn dots(name: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Series {
    Series {
        look: Look::Dots,
        ..line(name, color, points)
    }
}

fn tip_angle(chain: &Chain, published: &Chain) -> anyhow::Result<Figure> {
    let angle = |chain: &Chain, kpa: f64| (kpa, chain.tip_angle_rad(kpa).to_degrees());
    let every_2_kpa = (0..=(chain.max_pressure_kpa() / 2.0) as u32).map(|n| 2.0 * f64::from(n));
    let published_kpa = (3..=8).map(|n| 20.0 * f64::from(n));
    let panel = Panel {
        title: String::new(),
        x_label: "pressure, kPa",
        y_label: "tip angle, °",
        x: 0.0..165.0,
        y: 0.0..100.0,
        stages: Vec::new(),
        series: vec![
            line(
                "this finger",
                color(0),
                every_2_kpa.map(|p| angle(chain, p)).collect(),
            ),
            dots(
                "paper, table 3 over table 2",
                color(1),
                published_kpa.map(|p| angle(published, p)).collect(),
            ),
        ],
        legend: Some(SeriesLabelPosition::UpperLeft),
    };
    Ok(Figure {
        title: "Figure 15: how far a free finger bends".into(),
        svg: charts::draw(&[panel], 1, (WIDTH, 340))?,
        caption: html! { "Line: the recipe's finger. Dots: the sum of the paper's published joint torques over its joint stiffnesses. The paper's figure shows shapes from finite elements, of which the text gives no numbers." },
    })
}

/// Joints and tip of the free finger, mm: along the unbent finger, and across.
fn shape(chain: &Chain, pressure_kpa: f64) -> Vec<(f64, f64)> {
    let (mut x, mut y) = (0.0, 0.0);
    let links = chain
        .link_length_m
        .into_iter()
        .zip(chain.link_angles_rad(pressure_kpa));
    let ends = links.map(|(length, angle)| {
        x += 1e3 * length * angle.cos();
        y += 1e3 * length * angle.sin();
        (x, y)
    });
    std::iter::once((0.0, 0.0)).chain(ends).collect()
}

fn deflection(chain: &Chain, published: &Chain) -> anyhow::Result<Figure> {
    let panels = [100.0, 120.0, 140.0, 160.0].map(|kpa| Panel {
        title: format!("{kpa} kPa"),
        x_label: "along the unbent finger, mm",
        y_label: "deflection, mm",
        x: 0.0..105.0,
        y: 0.0..75.0,
        stages: Vec::new(),
        series: vec![
            line("this finger", color(0), shape(chain, kpa)),
            dots("paper, tables 2 and 3", color(1), shape(published, kpa)),
        ],
        legend: Some(SeriesLabelPosition::UpperLeft),
    });
    Ok(Figure {
        title: "Figures 19 and 20: the shape of a free finger".into(),
        svg: charts::draw(&panels, 2, (WIDTH / 2, 290))?,
        caption: html! { "Without gravity. Line: the recipe's chain of links. Dots: the joints that the paper's tables give. The measured shapes of the paper are pictures without numbers; it states that they differ from its theory by up to 13 %." },
    })
}

/// The run with every so many samples.
fn over_time(run: &Run, value: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
    let samples = run.samples.iter().step_by(EVERY);
    samples
        .map(|sample| (sample.truth.t_s, value(sample)))
        .collect()
}

fn object_and_mass(scenario: &Scenario) -> String {
    format!("{} of {:.0} g", scenario.object, 1e3 * scenario.mass_kg)
}

fn displacement(cases: &[Case]) -> anyhow::Result<Figure> {
    let end_s = cases
        .iter()
        .filter_map(|case| case.run.samples.last())
        .fold(1.0, |end: f64, sample| end.max(sample.truth.t_s));
    let series = cases.iter().enumerate().map(|(n, case)| {
        let stood = case.run.samples.first().map_or(0.0, height_mm);
        let name = format!("{} m/s²", case.run.scenario.accel_m_s2);
        // What falls past the fixture drops to the floor.
        let points = over_time(&case.run, |sample| (height_mm(sample) - stood).max(-60.0));
        line(&name, color(n), points)
    });
    let panel = Panel {
        title: String::new(),
        x_label: "s",
        y_label: "height, mm",
        x: 0.0..end_s,
        y: -60.0..230.0,
        stages: Vec::new(),
        series: series.collect(),
        legend: Some(SeriesLabelPosition::UpperRight),
    };
    Ok(Figure {
        title: format!(
            "Figure {}: displacement of the {}",
            cases[0].experiment.figures[0],
            object_and_mass(&cases[0].run.scenario)
        ),
        svg: charts::draw(&[panel], 1, (WIDTH, 300))?,
        caption: html! { "Height of the object's centre over its first place: it rises with the lift of 200 mm, stays while it is carried, and comes down when it is set down, or lost. A line that stays flat is an object off which the fingers slid. Simulated; the lengths of the moves are not in the paper." },
    })
}

/// Height of the object's centre over the ground's origin, mm.
fn height_mm(sample: &Sample) -> f64 {
    1e3 * (sample.truth.arm.position_m[2] + sample.truth.object_m[2])
}

fn strain(cases: &[Case]) -> anyhow::Result<Figure> {
    let panels: Vec<Panel> = cases.iter().map(|case| strain_panel(&case.run)).collect();
    Ok(Figure {
        title: format!(
            "Figure {}: strain with the {}",
            cases[0].experiment.figures[1],
            object_and_mass(&cases[0].run.scenario)
        ),
        svg: charts::draw(&panels, 3, (WIDTH / 3, 280))?,
        caption: html! { "Mean of the three gauges: bending strain as the converter gives it, and the contact residual that the controller sees. Stages as in the paper: I approach, II grip and lift, III transfer, IV drop. The paper's gauge feels contact alone, so its curve is the residual; bending strain rises when the object is lost, as the finger bends on. The scale is free: the paper says neither where its gauges are nor in which unit they are drawn." },
    })
}

fn strain_panel(run: &Run) -> Panel {
    let mean = |of: [f64; FINGERS]| 1e-3 * of.iter().sum::<f64>() / FINGERS as f64;
    let bending = over_time(run, |sample| mean(sample.strain_ue.map(f64::from)));
    let residual = over_time(run, |sample| {
        mean(
            sample
                .seen
                .residual
                .map(|residual| residual.map_or(0.0, |r| f64::from(r.0))),
        )
    });
    let flag = run
        .flagged_at_s
        .map(|t| line("", color(3), vec![(t, -4.0), (t, 27.0)]));
    let mut series = vec![
        line("strain", QUIET, bending),
        line("residual", color(0), residual),
    ];
    series.extend(flag);
    Panel {
        title: format!("{} m/s²{}", run.scenario.accel_m_s2, lost(run)),
        x_label: "s",
        y_label: "10³ µε",
        x: 0.0..run.samples.last().map_or(1.0, |sample| sample.truth.t_s),
        y: -4.0..30.0,
        stages: stages(run),
        series,
        legend: Some(SeriesLabelPosition::UpperRight),
    }
}

fn lost(run: &Run) -> String {
    let ms = run.latency_ms();
    ms.map_or(String::new(), |ms| {
        format!(": reported {}", words::latency(ms))
    })
}

/// The paper's four stages.
fn stages(run: &Run) -> Vec<(&'static str, f64, f64)> {
    let start = |phase: Phase| {
        let mut samples = run.samples.iter();
        let found = samples.find(|sample| sample.truth.arm.phase >= phase);
        found.map_or(0.0, |sample| sample.truth.t_s)
    };
    let (grip, carry, place) = (start(Phase::Grip), start(Phase::Carry), start(Phase::Place));
    let end = run.samples.last().map_or(0.0, |sample| sample.truth.t_s);
    vec![
        ("I", 0.0, grip),
        ("II", grip, carry),
        ("III", carry, place),
        ("IV", place, end),
    ]
}

fn summary(recipe: &Recipe, cases: &[Case]) -> anyhow::Result<Figure> {
    let panels = [ObjectKind::Sphere, ObjectKind::Cylinder].map(|object| {
        let mut setup = Setup::of(recipe)?;
        setup.scenario.object = object;
        let runs = |held: bool| {
            let wanted = cases.iter().map(|case| &case.run).filter(|run| {
                run.scenario.object == object && (run.outcome == Outcome::Hold) == held
            });
            wanted
                .map(|run| (run.scenario.accel_m_s2, 1e3 * run.scenario.mass_kg))
                .collect()
        };
        let lift_n = capability::static_lift_n(&setup);
        let statics = (2..=22).filter_map(|n| {
            let accel = f64::from(n) / 2.0;
            Some((accel, 1e3 * lift_n? / (GRAVITY_M_S2 + accel)))
        });
        Ok(Panel {
            title: object.to_string(),
            x_label: "greatest acceleration, m/s²",
            y_label: "mass, g",
            x: 0.0..12.0,
            y: 0.0..400.0,
            stages: Vec::new(),
            series: vec![
                dots("held", color(2), runs(true)),
                Series {
                    look: Look::Rings,
                    ..dots("lost", color(3), runs(false))
                },
                Series {
                    look: Look::Dashed,
                    ..line(
                        "statics of the finger model, lift",
                        color(1),
                        statics.collect(),
                    )
                },
            ],
            legend: Some(SeriesLabelPosition::UpperRight),
        })
    });
    let panels = panels.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    Ok(Figure {
        title: "Figure 29: what the gripper can hold".into(),
        svg: charts::draw(&panels, 2, (WIDTH / 2, 360))?,
        caption: html! { "The twelve runs, full where the object arrived. Dashed: what the statics of the finger model let it lift, slowly and straight. " code { "softgrip capability" } " finds the limit of the simulated gripper itself." },
    })
}
