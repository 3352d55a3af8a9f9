//! Separators, headers, comments, cells.

use super::bench::{HEADER, csv, csv_with, refused, thinned, understood};

#[test]
fn dialects_are_read_and_said() {
    let rows = thinned(5, 0);
    let plain = csv(&rows);
    let german = csv_with(&HEADER.replace(',', ";"), ";", &rows).replace('.', ",");
    understood(
        german.as_bytes(),
        &["separated by semicolon", "decimal commas"],
    );
    let tabs = csv_with(&HEADER.replace(',', "\t"), "\t", &rows);
    understood(tabs.as_bytes(), &["separated by tab"]);
    understood(
        format!("\u{feff}{}", plain.replace('\n', "\r\n")).as_bytes(),
        &[],
    );
    let wide: Vec<u8> = "\u{feff}"
        .chars()
        .chain(plain.chars())
        .flat_map(|c| (c as u16).to_le_bytes())
        .collect();
    understood(&wide, &[]);
    understood(plain.replace('\n', ",\n").as_bytes(), &[]);
    let body = &plain[HEADER.len()..];
    understood(
        format!("{HEADER},{}", body.replace('\n', ",\n")).as_bytes(),
        &[],
    );
    understood(
        format!("# rig 3\n\n{HEADER}\n\n# begins{body}").as_bytes(),
        &[],
    );
    understood(
        format!("Logger 5\nOperator: me\n{HEADER}{body}").as_bytes(),
        &["2 lines before"],
    );
    understood(
        format!("{HEADER}\ns,µε,ue,microstrain,kPa,kPa{body}").as_bytes(),
        &["line 2 taken for units"],
    );
    let latin: Vec<u8> = format!("{HEADER}\ns,\u{b5}e,ue,ue,kPa,kPa{body}")
        .chars()
        .map(|c| c as u8)
        .collect();
    understood(&latin, &["line 2 taken for units"]);
    let named = "Time (s),Strain 1 [µε],STRAIN2_UE,strain_3_ue,Pressure / kPa,Set-Point (kPa)";
    understood(format!("{named}{body}").as_bytes(), &[]);
    let quoted = plain
        .lines()
        .map(|line| format!("\"{}\"\n", line.replace(',', "\",\"")));
    understood(quoted.collect::<String>().as_bytes(), &[]);
    understood(
        &plain.as_bytes()[..plain.len() - 9],
        &["the last, is cut off"],
    );
}

#[test]
fn empty_cells_are_read_between_their_neighbours_and_counted() {
    let text = csv(&thinned(5, 0));
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    for (at, column) in [(180, 2), (181, 2), (500, 4)] {
        let mut cells: Vec<&str> = lines[at].split(',').collect();
        cells[column] = "";
        lines[at] = cells.join(",");
    }
    let text = lines.join("\n") + "\n";
    understood(
        text.as_bytes(),
        &[
            "strain2_ue: 2 empty, the first in line 181",
            "pressure_kpa: 1 empty",
        ],
    );
}

#[test]
fn what_is_ambiguous_is_refused_by_line_and_column() {
    let row = |line: &str| format!("{HEADER}\n0,0,0,0,0,0\n{line}\n0.2,0,0,0,0,0\n");
    refused(
        &row("0,1,0,0,0,0,0,0,0,0,0,0"),
        &["line 3: 12 cells", "decimal comma"],
    );
    refused(
        &row("0.1;0;0;0;0;0"),
        &["line 3: 1 cells", "separated as the header"],
    );
    refused(
        &row("0.1,0,\"1.234,5\",0,0,0"),
        &["line 3: strain2_ue", "thousands"],
    );
    let mixed = format!(
        "{}\n0,0;0;0;0;0;0\n0.1;0;0;0;0;0\n",
        HEADER.replace(',', ";")
    );
    refused(&mixed, &["line 3: t_s", "decimal ','"]);
    let rows = "\n0,0,0,0,0,0\n0.1,0,0,0,0,0\n";
    refused(
        &format!("{HEADER}\nms,ue,ue,ue,kPa,kPa{rows}"),
        &["t_s", "units row ms"],
    );
    refused(
        &format!("{HEADER}\ns,ue,ue,ue,kPa,atm{rows}"),
        &["line 2: setpoint_kpa", "\"atm\"", "psi"],
    );
    let bare = HEADER.replace("pressure_kpa", "pressure");
    refused(
        &format!("{bare}{rows}"),
        &["pressure: no unit", "pressure_kpa"],
    );
    let two = HEADER.replace("t_s", "time_s,t_ms");
    refused(
        &format!("{two}\n0,0,0,0,0,0,0\n"),
        &["line 1: time_s and t_ms", "t_s"],
    );
}
