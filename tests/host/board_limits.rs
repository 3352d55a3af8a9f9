//! The limits of the bring-up list in `boards/README.md`, from the tolerances of the parts: no good board is
//! rejected, and the wrong parts that a check is said to find are found.

mod checks;
mod parts;

use checks::{Check, checks};
use parts::Part;
use softgrip::frontend::FrontEnd;
use softgrip::table::FINGER;
use softgrip::units::{AdcCode, Kilopascals};

const FE: FrontEnd = FrontEnd::REFERENCE;
const PAGE: &str = include_str!("../../boards/README.md");

/// What good boards show.
#[derive(Debug, Clone, Copy)]
struct Range {
    /// With all parts at their values.
    value: f64,
    /// Worst case: every combination of the parts' ends.
    low: f64,
    high: f64,
    /// Root of the sum of the squares of what each part does by itself: few boards are farther off.
    rss: f64,
}

fn range<const N: usize>(parts: [Part; N], shows: impl Fn([f64; N]) -> f64) -> Range {
    let value = shows(parts.map(|part| part.value));
    let (mut low, mut high) = (value, value);
    for corner in 0..1usize << N {
        let shown = shows(core::array::from_fn(|i| match corner >> i & 1 {
            0 => parts[i].low,
            _ => parts[i].high,
        }));
        (low, high) = (low.min(shown), high.max(shown));
    }
    let one = |at: usize, end: f64| {
        let mut values = parts.map(|part| part.value);
        values[at] = end;
        (shows(values) - value).abs()
    };
    let squares = (0..N).map(|i| one(i, parts[i].low).max(one(i, parts[i].high)).powi(2));
    Range {
        value,
        low,
        high,
        rss: squares.sum::<f64>().sqrt(),
    }
}

/// A row of the page with so many cells.
fn row(name: &str, cells: usize) -> Vec<&'static str> {
    let split = |line: &'static str| -> Vec<&'static str> {
        let inner = line.trim_start_matches('|').trim_end_matches('|');
        inner.split('|').map(str::trim).collect()
    };
    PAGE.lines()
        .map(split)
        .find(|row| row.len() == cells && row[0] == name)
        .unwrap_or_else(|| panic!("boards/README.md has no row of {cells} cells for “{name}”"))
}

/// How many rows the table has that begins with this cell.
fn rows(first: &str) -> usize {
    PAGE.lines()
        .skip_while(|line| !line.starts_with(&format!("| {first} |")))
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .count()
}

fn number(cell: &str) -> f64 {
    let plain: String = cell
        .replace('−', "-")
        .chars()
        .filter(|c| !c.is_whitespace())
        .collect();
    plain
        .parse()
        .unwrap_or_else(|_| panic!("boards/README.md: “{cell}” is no number"))
}

/// What the page allows, lowest and highest.
fn allowed(check: &Check) -> (f64, f64) {
    let cells = row(check.name, 7);
    (number(cells[3]), number(cells[4]))
}

/// To the digits of the page: outwards, so that rounding rejects no good board.
fn rounded(check: &Check) -> [f64; 4] {
    let Check { good, step, .. } = check;
    let to = |x: f64, round: fn(f64) -> f64| round(x / step) * step;
    [
        to(good.value, f64::round),
        to(good.low, f64::floor),
        to(good.high, f64::ceil),
        to(good.rss, f64::ceil),
    ]
}

#[test]
fn the_page_says_the_computed_board_limits() {
    for check in checks() {
        let cells = row(check.name, 7);
        let page = [2, 3, 4, 5].map(|cell| number(cells[cell]));
        let computed = rounded(&check);
        for (said, right) in page.into_iter().zip(computed) {
            assert!(
                (said - right).abs() < 1e-6 * check.step.max(1.0),
                "{}: the page says {page:?}, right is {computed:.3?}",
                check.name
            );
        }
    }
}

#[test]
fn no_good_board_is_rejected() {
    for check in checks() {
        let (low, high) = allowed(&check);
        let Range {
            low: l, high: h, ..
        } = check.good;
        assert!(low <= l && h <= high, "{}: {:?}", check.name, check.good);
    }
}

#[test]
fn every_wrong_part_that_a_board_check_is_said_to_find_is_found() {
    for check in checks() {
        let said = row(check.name, 7)[6];
        let names: Vec<&str> = check.wrong.iter().map(|(name, _)| *name).collect();
        assert_eq!(said, names.join("; "), "{}", check.name);
        let (low, high) = allowed(&check);
        for (name, shown) in &check.wrong {
            assert!(
                shown.high < low || high < shown.low,
                "{}, {name}: {shown:?} passes {low} to {high}",
                check.name
            );
        }
    }
}

#[test]
fn the_table_of_the_board_page_has_no_check_that_is_not_computed() {
    assert_eq!(rows("check"), checks().len());
}

#[test]
fn the_command_of_a_board_in_reset_is_less_than_an_open_finger_allows() {
    // kPa below which the fingers count as open (`src/estimate.rs`), of 200 at 10 V.
    let open = 6.0 / 200.0 * 10.0;
    for name in [
        "command, reset held down, V",
        "command at rest, regulator unplugged, V",
    ] {
        assert!(number(row(name, 7)[4]) < open, "{name}");
    }
}

/// A limit of the controller, what a good board comes to at its worst, and what that leaves, to whole numbers.
struct Margin {
    name: &'static str,
    is: f64,
    comes_to: f64,
    leaves: f64,
}

fn below(name: &'static str, is: f64, highest: f64) -> Margin {
    let comes_to = highest.ceil();
    Margin {
        name,
        is,
        comes_to,
        leaves: is - comes_to,
    }
}

/// Farthest zero of a bridge, µε, and what few boards exceed.
fn zero_ue(bridge: Range) -> (f64, f64) {
    let ue = |code: f64| (code - f64::from(FE.amplifier.zero)) * f64::from(FE.gauge_ue_per_code[0]);
    let few = ue(bridge.value + bridge.rss).max(-ue(bridge.value - bridge.rss));
    (ue(bridge.high).max(-ue(bridge.low)), few)
}

fn two_gauges() -> Range {
    let gain = parts::TWO_GAUGES_GAIN;
    checks::bridge(parts::GAUGE, parts::GAUGE, gain, parts::PULL_UP)
}

fn one_gauge() -> Range {
    let gain = parts::ONE_GAUGE_GAIN;
    checks::bridge(parts::BRIDGE, parts::GAUGE, gain, parts::PULL_UP)
}

fn margins() -> Vec<Margin> {
    let code = |AdcCode(code): AdcCode| f64::from(code);
    let grounded = checks::shorted_wire();
    let open = checks::open_wire().low.floor();
    let full_scale = f64::from(FE.amplifier.full_scale.0);
    // What a strain of full scale is read too high; the resistor of the gain is good for 0.1 %.
    let amplifier = parts::AMPLIFIER_GAIN.high * 1.001;
    let gain = full_scale * (parts::GAUGE_FACTOR.high * amplifier - 1.0);
    let (two, _) = zero_ue(two_gauges());
    let (one, _) = zero_ue(one_gauge());
    // `TARE_LIMIT_UE` in `src/zero.rs`, 5 kPa above the highest limit of pressure, and 5 % of the rail.
    let (tare, pressure, rail_mv) = (2_000.0, Kilopascals(165.0), 165.0);
    vec![
        below("short, code", code(FE.amplifier.short_below), grounded.high),
        Margin {
            name: "open, code",
            is: code(FE.amplifier.open_above),
            comes_to: open,
            leaves: open - code(FE.amplifier.open_above),
        },
        below("full scale, two active gauges, µε", full_scale, two + gain),
        below("full scale, one active gauge, µε", full_scale, one + gain),
        below("tare, two active gauges, µε", tare, two),
        below("tare, one active gauge, µε", tare, one),
        below(
            "monitor too high, code",
            code(FE.monitor_high_above),
            checks::highest_monitor_code(pressure),
        ),
        below("rail, mV off", rail_mv, checks::rail_told_off()),
    ]
}

#[test]
fn the_board_page_says_what_the_limits_of_the_controller_leave() {
    for margin in margins() {
        let cells = row(margin.name, 5);
        let page = [2, 3, 4].map(|cell| number(cells[cell]));
        let computed = [margin.is, margin.comes_to, margin.leaves];
        assert_eq!(page, computed, "{}", margin.name);
    }
    assert_eq!(rows("limit"), margins().len());
}

#[test]
fn the_limits_of_the_controller_refuse_no_good_board_but_where_the_board_page_says_so() {
    let refused: Vec<&str> = margins()
        .iter()
        .filter(|margin| margin.leaves < 0.0)
        .map(|margin| margin.name)
        .collect();
    let known = ["tare, one active gauge, µε"];
    assert_eq!(refused, known);
    for (bridge, gauges) in [(two_gauges(), "two active gauges"), (one_gauge(), "one")] {
        let (_, few) = zero_ue(bridge);
        assert!(few < 2_000.0, "{gauges}: {few}");
        let said = format!(
            "±{} {:03} µε ({gauges}",
            few.ceil() as u32 / 1_000,
            few.ceil() as u32 % 1_000
        );
        assert!(
            PAGE.contains(&said),
            "boards/README.md does not say “{said}”"
        );
    }
}

#[test]
fn the_finger_at_its_highest_pressure_is_within_full_scale_on_every_board() {
    let strain = FINGER.rows.map(|row| row.free_strain_ue);
    let most = f64::from(strain.into_iter().fold(0.0, f32::max));
    for margin in margins()
        .iter()
        .filter(|margin| margin.name.starts_with("full scale"))
    {
        assert!(most < margin.leaves, "{}: {most}", margin.name);
    }
}
