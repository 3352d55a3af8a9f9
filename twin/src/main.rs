//! scratch
fn main() {
    let g = twin::gripper::Gripper::reference();
    let r = finger::recipe::load(std::path::Path::new("recipes/paper.toml")).unwrap();
    let t = finger::table::Table::of(&r);
    let table = twin::sim::leak_table(&t);
    use twin::scenario::*;
    for (object, mass_kg, a) in [
        (ObjectKind::Sphere, 0.15, 2.0),
        (ObjectKind::Sphere, 0.15, 5.0),
        (ObjectKind::Sphere, 0.15, 10.0),
        (ObjectKind::Sphere, 0.25, 2.0),
        (ObjectKind::Sphere, 0.25, 5.0),
        (ObjectKind::Sphere, 0.25, 10.0),
        (ObjectKind::Cylinder, 0.08, 2.0),
        (ObjectKind::Cylinder, 0.08, 5.0),
        (ObjectKind::Cylinder, 0.08, 10.0),
        (ObjectKind::Cylinder, 0.15, 2.0),
        (ObjectKind::Cylinder, 0.15, 5.0),
        (ObjectKind::Cylinder, 0.15, 10.0),
    ] {
        let s = Scenario {
            object,
            mass_kg,
            accel_m_s2: a,
            ..Default::default()
        };
        let c = twin::sim::controller(table, &Default::default()).unwrap();
        let run = twin::sim::run(&s, &g, &r.chain, c, |_| {});
        println!("{}", run.json());
        if let Ok(dir) = std::env::var("DUMP") {
            use std::io::Write;
            let mut f =
                std::fs::File::create(format!("{dir}/{}-{}-{}.csv", object, mass_kg, a)).unwrap();
            for s in &run.samples {
                let t = &s.truth;
                writeln!(
                    f,
                    "{:.3},{:?},{:.2},{:.1},{:.1},{:.1},{:.1},{:.1},{:.1},{:.4},{:.3},{:.3}",
                    t.t_s,
                    t.arm.phase,
                    t.pressure_kpa,
                    t.residual_ue[0],
                    t.residual_ue[1],
                    t.residual_ue[2],
                    s.seen.residual[0].map_or(f32::NAN, |x| x.0),
                    s.seen.residual[1].map_or(f32::NAN, |x| x.0),
                    s.seen.residual[2].map_or(f32::NAN, |x| x.0),
                    t.object_m[2],
                    s.seen.level.unwrap_or(f32::NAN),
                    s.seen.setpoint.0
                )
                .unwrap();
            }
        }
    }
}
