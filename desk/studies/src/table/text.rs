//! The table report as text.

use std::fmt::Write;

use finger::chain::LINKS;
use softgrip::table::{self, ObjectKind};
use softgrip::units::Kilopascals;

use super::{PUBLISHED_KPA, TableReport, angles, masses, stiffness, torques};

impl TableReport {
    /// The report in columns; below each published number is our difference from it.
    pub fn text(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = self.head(&mut out);
        let _ = self.joints(&mut out);
        let _ = self.pressures(&mut out);
        let _ = self.continuum(&mut out);
        let _ = self.sensitivities(&mut out);
        out
    }

    fn head(&self, out: &mut String) -> std::fmt::Result {
        let table = &self.table;
        writeln!(
            out,
            "recipe {}, inputs {:016x}, made in {:.2} s",
            table.recipe, table.inputs_hash, self.generation_s
        )?;
        writeln!(
            out,
            "{} rows to {} kPa, {} bytes of flash; interpolation within {:.3} % of full scale, lift within {:.2} %\n",
            table.rows.len(),
            table.max_pressure_kpa,
            size_of_val(table),
            table.error_bound_percent,
            table.lift_error_percent,
        )?;
        if self.recipe.grasp.is_none() {
            return writeln!(out, "no [grasp] in the recipe: lift unknown\n");
        }
        for (name, kind) in [
            ("sphere", ObjectKind::Sphere),
            ("cylinder", ObjectKind::Cylinder),
        ] {
            match table::lift_known_to(table, kind) {
                Some(Kilopascals(end)) if end < table.max_pressure_kpa => writeln!(
                    out,
                    "lift of the {name} known up to {end} kPa: beyond, fingers and object find no equilibrium\n"
                )?,
                Some(_) => {}
                None => writeln!(
                    out,
                    "lift of the {name} unknown: fingers and object find no equilibrium\n"
                )?,
            }
        }
        Ok(())
    }

    fn joints(&self, out: &mut String) -> std::fmt::Result {
        let (ours, theirs) = (&self.recipe.chain, &self.published);
        let numbers: [String; LINKS] = std::array::from_fn(|i| format!("{}", i + 1));
        writeln!(out, "{:<26}{}", "joint or link", columns(&numbers))?;
        for (name, ours, theirs) in [
            ("stiffness, N·mm/deg", stiffness(ours), stiffness(theirs)),
            ("link mass, g", masses(ours), masses(theirs)),
        ] {
            writeln!(out, "{name:<26}{}", columns(&ours.map(two)))?;
            writeln!(out, "{:<26}{}", "  published", columns(&theirs.map(two)))?;
            writeln!(out, "{:<26}{}", "  off by, %", columns(&off(ours, theirs)))?;
        }
        writeln!(out)
    }

    fn pressures(&self, out: &mut String) -> std::fmt::Result {
        let (ours, theirs) = (&self.recipe.chain, &self.published);
        writeln!(
            out,
            "{:<13}{:>10}{:>8}{:>14}{:>8}{:>8}   joint torque, N·mm",
            "kPa", "strain µε", "tip °", "tip mm", "lift N", "(cyl.)"
        )?;
        for &p in &self.pressures_kpa {
            let [x, y] = ours.tip_position_m(p).map(|m| 1e3 * m);
            let [sphere, cylinder] = self
                .lift_n(p)
                .map(|lift| lift.map_or("-".into(), |n| format!("{n:.2}")));
            let angle = ours.tip_angle_rad(p).to_degrees();
            writeln!(
                out,
                "{p:<13}{:>10.0}{angle:>8.2}{:>14}{sphere:>8}{cylinder:>8} {}",
                ours.free_strain_ue(p),
                format!("{x:.1} {y:.1}"),
                columns(&torques(ours, p).map(two)),
            )?;
            if PUBLISHED_KPA.contains(&p) {
                let published = theirs.tip_angle_rad(p).to_degrees();
                let blank = "";
                writeln!(
                    out,
                    "  published  {blank:>10}{published:>8.2}{blank:>30} {}",
                    columns(&torques(theirs, p).map(two)),
                )?;
                writeln!(
                    out,
                    "  off by, %  {blank:>10}{:>8.1}{blank:>30} {}",
                    percent(angle, published),
                    columns(&off(torques(ours, p), torques(theirs, p))),
                )?;
                let [a, b] = [ours, theirs].map(|chain| angles(chain, p));
                let differences = std::array::from_fn(|i| format!("{:+.2}", a[i] - b[i]));
                writeln!(
                    out,
                    "  joint angle off by, degrees{blank:>33} {}",
                    columns(&differences)
                )?;
            }
        }
        writeln!(
            out,
            "joint angles off by {:.2}° rms over tables 2 and 3\n",
            self.joint_angle_rms_deg()
        )
    }

    fn continuum(&self, out: &mut String) -> std::fmt::Result {
        let Some(solved) = &self.solved else {
            return Ok(());
        };
        writeln!(
            out,
            "{:<6}{:>16}{:>16}{:>12}   the paper's eq. 16",
            "kPa", "curvature 1/m", "stretch", "chain off %"
        )?;
        let span = |list: &[f64], decimals: usize| match list {
            [first, .., last] => format!("{first:.decimals$} … {last:.decimals$}"),
            _ => String::new(),
        };
        for bend in &solved.bends {
            let p = bend.pressure_kpa;
            let paper = match self.paper_tip_angle_deg(p) {
                Some(Ok(angle)) => format!("tip at {angle:.1}°"),
                Some(Err(why)) => why,
                None => String::new(),
            };
            writeln!(
                out,
                "{p:<6}{:>16}{:>16}{:>12.2}   {paper}",
                span(&bend.curvature_per_m, 1),
                span(&bend.stretch, 3),
                100.0 * solved.chain_tip_error(bend),
            )?;
        }
        writeln!(
            out,
            "from clamp to end of bore; the chain's tip against the continuum's, of the length\n"
        )
    }

    fn sensitivities(&self, out: &mut String) -> std::fmt::Result {
        if self.sensitivity.is_empty() {
            return Ok(());
        }
        let head: String = self
            .pressures_kpa
            .iter()
            .map(|p| format!("{p:>8}"))
            .collect();
        writeln!(out, "{:<26}{head}", "tip angle, % at kPa")?;
        for row in &self.sensitivity {
            let cells = match &row.tip_angle_percent {
                Some(list) => list.iter().map(|x| format!("{x:>+8.1}")).collect(),
                None => "  no stable state".to_string(),
            };
            writeln!(out, "{:<26}{cells}", row.change)?;
        }
        Ok(())
    }
}

fn two(value: f64) -> String {
    format!("{value:.2}")
}

fn percent(ours: f64, theirs: f64) -> f64 {
    100.0 * (ours / theirs - 1.0)
}

fn off(ours: [f64; LINKS], theirs: [f64; LINKS]) -> [String; LINKS] {
    std::array::from_fn(|i| format!("{:+.1}", percent(ours[i], theirs[i])))
}

fn columns(values: &[String; LINKS]) -> String {
    values.iter().map(|value| format!("{value:>8}")).collect()
}
