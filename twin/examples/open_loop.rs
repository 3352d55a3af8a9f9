//! Scratch: drives the world open-loop and measures outcomes and residuals.
use std::time::Instant;
use twin::arm::{Motion, Phase, Profile};
use twin::world::{Finger, Shape, World, WorldConfig};

const P: [f64; 8] = [0.0, 48.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0];
const T: [[f64; 6]; 8] = [
    [0.0; 6],
    [6.0, 0.6, 1.5, 1.0, 0.6, 0.3],
    [12.64, 2.67, 4.73, 3.59, 2.43, 1.13],
    [19.69, 7.37, 9.85, 6.16, 6.14, 3.23],
    [28.71, 13.62, 16.13, 11.01, 10.67, 4.71],
    [37.41, 19.72, 24.49, 16.23, 16.15, 6.05],
    [48.08, 24.14, 31.28, 22.24, 22.41, 7.12],
    [56.77, 28.22, 36.67, 26.76, 29.85, 10.09],
];
const K: [f64; 6] = [4.12, 1.95, 1.87, 1.68, 1.62, 1.12];

fn torque(p: f64) -> [f64; 6] {
    let p = p.clamp(0.0, 160.0);
    let i = P.windows(2).position(|w| p <= w[1]).unwrap();
    let f = (p - P[i]) / (P[i + 1] - P[i]);
    std::array::from_fn(|j| 1e-3 * (T[i][j] + f * (T[i + 1][j] - T[i][j])))
}
fn stiffness() -> [f64; 6] {
    K.map(|k| k * 1e-3 * 180.0 / std::f64::consts::PI)
}

#[derive(Clone)]
struct Case {
    w: WorldConfig,
    m: Motion,
    p: f64,
    reg: f64,
    infl: f64,
}

fn case(sphere: bool, mass_g: f64, a: f64) -> Case {
    let finger = Finger {
        length_m: [0.018, 0.018, 0.018, 0.018, 0.018, 0.010],
        mass_kg: [0.00394, 0.00394, 0.00394, 0.00394, 0.00405, 0.00136],
        stiffness_nm_rad: stiffness(),
        damping_s: 0.0029 / stiffness()[1],
    };
    Case {
        w: WorldConfig {
            fingers: [finger; 3],
            link_radius_m: 0.0045,
            palm_radius_m: 0.03998,
            first_finger_rad: 0.0,
            shape: if sphere {
                Shape::Sphere { diameter_m: 0.07 }
            } else {
                Shape::Cylinder {
                    diameter_m: 0.07,
                    height_m: 0.07,
                }
            },
            mass_kg: mass_g * 1e-3,
            grasp_depth_m: if sphere { 0.039 } else { 0.057 },
            friction: 0.8,
            carry_m: 0.8,
            fingers_touch: std::env::var("TOUCH").is_ok(),
        },
        m: Motion {
            acceleration_m_s2: a,
            ..Motion::default()
        },
        p: 140.0,
        reg: 0.08,
        infl: 0.08,
    }
}

struct Run {
    outcome: &'static str,
    lost_s: f64,
    slip_end: f64,
    slip_max: f64,
    trace: Vec<(f64, Phase, [f64; 3], [f64; 3], [f64; 3])>, // t, phase, object, residual, force
    wall: f64,
}

fn run(c: &Case) -> Run {
    let prof = Profile::new(&c.m);
    let mut w = World::new(&c.w, prof.at(0.0).position_m);
    let start = Instant::now();
    let (mut pr, mut pi) = (0.0, 0.0);
    let mut reference: Option<[f64; 3]> = None;
    let mut outcome = "hold";
    let (mut lost, mut slip, mut slip_max) = (f64::NAN, 0.0, 0.0f64);
    let mut trace = vec![];
    let n = (prof.duration_s() / 1e-3) as usize;
    let k = stiffness();
    for s in 1..=n {
        let t = s as f64 * 1e-3;
        let arm = prof.at(t);
        let target = if arm.phase.wants_grip() { c.p } else { 0.0 };
        pr += (target - pr) * (1.0 - (-1e-3 / c.reg).exp());
        pi += (pr - pi) * (1.0 - (-1e-3 / c.infl).exp());
        let tq = torque(pi);
        w.step(&[tq; 3], arm.position_m);
        let o = w.object_position();
        if arm.phase == Phase::Lift && reference.is_none() {
            reference = Some(o);
        }
        if let Some(r) = reference
            && arm.phase < Phase::Release
        {
            let d = (0..3).map(|i| (o[i] - r[i]).powi(2)).sum::<f64>().sqrt();
            slip = d;
            slip_max = slip_max.max(d);
            if d > 0.02 && outcome == "hold" {
                lost = t;
                outcome = match arm.phase {
                    Phase::Lift => "pick",
                    Phase::Carry => "transfer",
                    Phase::Place => "place",
                    _ => "hold",
                };
            }
        }
        let free: f64 = (0..3).map(|i| tq[i] / k[i]).sum();
        let res = w.joint_angles().map(|f| free - f[..3].iter().sum::<f64>());
        trace.push((t, arm.phase, o, res, w.contact_force()));
    }
    Run {
        outcome,
        lost_s: lost,
        slip_end: slip,
        slip_max,
        trace,
        wall: start.elapsed().as_secs_f64() / (n as f64 * 1e-3),
    }
}

const GRID: [(bool, f64, f64); 12] = [
    (true, 150.0, 2.0),
    (true, 150.0, 5.0),
    (true, 150.0, 10.0),
    (true, 250.0, 2.0),
    (true, 250.0, 5.0),
    (true, 250.0, 10.0),
    (false, 80.0, 2.0),
    (false, 80.0, 5.0),
    (false, 80.0, 10.0),
    (false, 150.0, 2.0),
    (false, 150.0, 5.0),
    (false, 150.0, 10.0),
];

fn main() {
    let args: Vec<String> = std::env::args().collect();
    match args.get(1).map(String::as_str) {
        Some("trace") => {
            let c = case(
                args[2] == "sphere",
                args[3].parse().unwrap(),
                args[4].parse().unwrap(),
            );
            let r = run(&c);
            for (i, (t, ph, o, res, f)) in r.trace.iter().enumerate() {
                if i % 5 == 0 {
                    println!(
                        "{t:.3} {ph:?} {:.2} {:.2} {:.2}  {:.4} {:.4} {:.4} sum {:.4}  {:.2} {:.2} {:.2}",
                        o[0] * 1e3,
                        o[1] * 1e3,
                        o[2] * 1e3,
                        res[0],
                        res[1],
                        res[2],
                        res.iter().sum::<f64>(),
                        f[0],
                        f[1],
                        f[2]
                    );
                }
            }
        }
        Some("metrics") => {
            for (sp, m, a) in GRID {
                let c = case(sp, m, a);
                let r = run(&c);
                let sum = |i: usize| r.trace[i].3.iter().sum::<f64>();
                let prof = Profile::new(&c.m);
                let ms = |t: f64| (t * 1e3) as usize;
                let (lift, rel) = (
                    ms(prof.start_s(Phase::Lift)),
                    ms(prof.start_s(Phase::Release)),
                );
                let plateau = (lift - 50..lift).map(sum).sum::<f64>() / 50.0;
                let slip = |i: usize, i0: usize| {
                    (0..3)
                        .map(|x| (r.trace[i].2[x] - r.trace[i0].2[x]).powi(2))
                        .sum::<f64>()
                        .sqrt()
                };
                print!(
                    "{} {m} {a} {:9} plateau {:.4} ",
                    if sp { "sphere" } else { "cyl" },
                    r.outcome,
                    plateau / 3.0
                );
                if r.outcome == "hold" {
                    let (lo, hi) = (lift..rel)
                        .map(sum)
                        .fold((9.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
                    let each = (0..3)
                        .map(|f| {
                            let p = r.trace[lift - 1].3[f];
                            let (l, h) = (lift..rel)
                                .map(|i| r.trace[i].3[f])
                                .fold((9.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
                            format!("[{:.3} {:.3}]", l / p, h / p)
                        })
                        .collect::<Vec<_>>()
                        .join(" ");
                    println!(
                        "sum range {:.4}..{:.4} fingers {each} slip end {:.4} mm",
                        lo / plateau,
                        hi / plateau,
                        slip(rel - 1, lift) * 1e3
                    );
                } else {
                    let t10 = (lift..rel).find(|&i| sum(i) < 0.1 * plateau);
                    let end = t10.unwrap_or(rel);
                    let t90 = (lift..end).rev().find(|&i| sum(i) > 0.9 * plateau).unwrap();
                    let t50 = (t90..end).find(|&i| sum(i) < 0.5 * plateau).unwrap_or(0);
                    let peak = (lift..end).map(sum).fold(0.0f64, f64::max);
                    let s20 = ms(r.lost_s);
                    let min = (t90..rel).map(sum).fold(9.0f64, f64::min);
                    let floor = sum((end + 500).min(rel - 1));
                    let range: Vec<String> = (0..3)
                        .map(|f| {
                            let p = r.trace[lift - 1].3[f];
                            let z = (lift..rel).find(|&i| r.trace[i].3[f] < 0.3 * p);
                            format!("{:?}", z.map(|z| z as i64 - t90 as i64))
                        })
                        .collect();
                    let slipping = (lift..end).find(|&i| slip(i, lift) > 1e-3).unwrap_or(0);
                    println!(
                        "t1mm {:.3} t20mm {:.3} t90 {:.3} (20mm leads {} ms, 1mm leads {}) 90-50 {} 90-10 {:?} peak {:.3} min {:.3} floor {:.3} fingers<30% after t90 {}",
                        slipping as f64 * 1e-3,
                        r.lost_s,
                        t90 as f64 * 1e-3,
                        t90 as i64 - s20 as i64,
                        t90 as i64 - slipping as i64,
                        t50 as i64 - t90 as i64,
                        t10.map(|t| t - t90),
                        peak / plateau,
                        min / plateau,
                        floor / plateau,
                        range.join(" ")
                    );
                }
            }
        }
        Some("lag") => {
            let mut c = case(true, 150.0, 2.0);
            c.w.grasp_depth_m = 10.0;
            let k = stiffness();
            let steps = 3000;
            for (from, to) in [(0.0, 140.0), (140.0, 0.0), (100.0, 140.0), (0.0, 60.0)] {
                let mut w = World::new(&c.w, [0.0; 3]);
                for _ in 0..3000 {
                    w.step(&[torque(from); 3], [0.0; 3]);
                }
                let (mut pr, mut pi) = (from, from);
                let mut data = vec![]; // pr, measured
                for _ in 0..steps {
                    pr += (to - pr) * (1.0 - (-1e-3 / c.reg).exp());
                    pi += (pr - pi) * (1.0 - (-1e-3 / c.infl).exp());
                    w.step(&[torque(pi); 3], [0.0; 3]);
                    data.push((pr, w.joint_angles()[0][..3].iter().sum::<f64>()));
                }
                // The static map with gravity, by slow settling.
                let stat: Vec<f64> = (0..=160)
                    .map(|p| {
                        let mut w = World::new(&c.w, [0.0; 3]);
                        for _ in 0..1500 {
                            w.step(&[torque(p as f64); 3], [0.0; 3]);
                        }
                        w.joint_angles()[0][..3].iter().sum()
                    })
                    .collect();
                let map = |p: f64| {
                    let i = (p as usize).min(159);
                    stat[i] + (p - i as f64) * (stat[i + 1] - stat[i])
                };
                let free: f64 = (0..3).map(|i| torque(to)[i] / k[i]).sum();
                let eval = |a: f64, b: f64, cc: f64| {
                    let (mut x, mut y, mut z) = (from, map(from), map(from));
                    let mut worst = 0.0f64;
                    let mut sq = 0.0;
                    for &(pr, phi) in &data {
                        x += (pr - x) * (1.0 - (-1e-3 / a).exp());
                        y += (map(x) - y) * (1.0 - (-1e-3 / b).exp());
                        z += (y - z) * (1.0 - (-1e-3 / cc).exp());
                        worst = worst.max((z - phi).abs());
                        sq += (z - phi) * (z - phi);
                    }
                    (worst, (sq / steps as f64).sqrt())
                };
                let overshoot = data.iter().map(|d| d.1).fold(0.0f64, f64::max) / map(to);
                println!(
                    "step {from} -> {to}: static {:.4} (T/k {free:.4}) max/static {overshoot:.4}; unlagged map error {:.4}",
                    map(to),
                    eval(1e-6, 1e-6, 1e-6).0
                );
                let mut best = vec![];
                for a in 20..=140 {
                    for b in 0..=80 {
                        let (a, b) = (a as f64 * 1e-3, b as f64 * 1e-3 + 1e-6);
                        best.push((eval(a, b, 1e-6), a, b));
                    }
                }
                best.sort_by(|x, y| x.0.0.total_cmp(&y.0.0));
                println!("  minimax a (pressure lag) b (angle lag): {:?}", best[0]);
                best.sort_by(|x, y| x.0.1.total_cmp(&y.0.1));
                println!("  rms: {:?}", best[0]);
                let at80: Vec<_> = (0..=60)
                    .map(|b| (eval(0.08, b as f64 * 1e-3 + 1e-6, 1e-6), b))
                    .collect();
                println!(
                    "  a = 80 ms: {:?}",
                    at80.iter().min_by(|x, y| x.0.0.total_cmp(&y.0.0))
                );
                let mut eq: Vec<_> = (40..=90)
                    .map(|a| (eval(a as f64 * 1e-3, a as f64 * 1e-3, 1e-6), a))
                    .collect();
                eq.sort_by(|x, y| x.0.0.total_cmp(&y.0.0));
                println!("  equal lags: {:?}", eq[0]);
                let mut two: Vec<_> = vec![];
                for a in 20..=120 {
                    for b in 0..=a {
                        two.push((eval(1e-6, a as f64 * 1e-3, b as f64 * 1e-3 + 1e-6), a, b));
                    }
                }
                two.sort_by(|x, y| x.0.0.total_cmp(&y.0.0));
                let second = |a: f64, w: f64, zeta: f64| {
                    let (mut x, mut y, mut v, mut worst) = (from, map(from), 0.0, 0.0f64);
                    for &(pr, phi) in &data {
                        x += (pr - x) * (1.0 - (-1e-3 / a).exp());
                        v += 1e-3 * (w * w * (map(x) - y) - 2.0 * zeta * w * v);
                        y += 1e-3 * v;
                        worst = worst.max((y - phi).abs());
                    }
                    worst
                };
                let mut so = vec![];
                for w in 10..=60 {
                    for z in 2..=24 {
                        so.push((second(0.08, w as f64, z as f64 * 0.05), w, z as f64 * 0.05));
                    }
                }
                so.sort_by(|x, y| x.0.total_cmp(&y.0));
                println!(
                    "  80 ms then second order: {:?}; at 36 rad/s 0.5: {:.4}",
                    so[0],
                    second(0.08, 36.0, 0.5)
                );
                println!("  80/27: {:?}", eval(0.08, 0.027, 1e-6));
                println!("  both lags after the map: {:?}", two[0]);
            }
        }
        Some("edge") => {
            let scans: [(&str, Vec<f64>, fn(&mut Case, f64)); 7] = [
                (
                    "mu",
                    (0..13).map(|i| 0.68 + 0.02 * i as f64).collect(),
                    |c, v| c.w.friction = v,
                ),
                ("depth mm", (-4..5).map(f64::from).collect(), |c, v| {
                    c.w.grasp_depth_m += v * 1e-3
                }),
                (
                    "palm mm",
                    (-3..11).map(|i| f64::from(i) * 0.15).collect(),
                    |c, v| c.w.palm_radius_m += v * 1e-3,
                ),
                (
                    "jerk ms",
                    (1..11).map(|i| f64::from(i) * 10.0).collect(),
                    |c, v| c.m.jerk_ramp_s = v * 1e-3,
                ),
                (
                    "p kPa",
                    (-5..6).map(|i| 140.0 + f64::from(i)).collect(),
                    |c, v| c.p = v,
                ),
                (
                    "mass g",
                    (-5..6).map(|i| 150.0 + 2.0 * f64::from(i)).collect(),
                    |c, v| c.w.mass_kg = v * 1e-3,
                ),
                (
                    "acc",
                    (0..13).map(|i| 5.0 + 0.5 * f64::from(i)).collect(),
                    |c, v| c.m.acceleration_m_s2 = v,
                ),
            ];
            for (name, values, set) in &scans {
                print!("{name}:");
                for &v in values {
                    let mut c = case(true, 150.0, 10.0);
                    set(&mut c, v);
                    let r = run(&c);
                    print!(" {v:.2}={}({:.1})", r.outcome, r.slip_max.min(0.0999) * 1e3);
                }
                println!();
            }
        }
        Some("creep") => {
            for (sp, m) in [(true, 150.0), (false, 80.0)] {
                let mut c = case(sp, m, 2.0);
                c.m.dwell_s = 10.0;
                let r = run(&c);
                let at = (Profile::new(&c.m).start_s(Phase::Carry) * 1e3) as usize;
                let d = |i: usize| {
                    (0..3)
                        .map(|x| (r.trace[at].2[x] - r.trace[i].2[x]).powi(2))
                        .sum::<f64>()
                        .sqrt()
                };
                println!(
                    "sphere {sp}: creep over the last 9 s of the lift dwell: {:.6} mm/s",
                    d(at - 9000) * 1e3 / 9.0
                );
            }
        }
        Some("robust") => {
            let variants: Vec<(String, Box<dyn Fn(&mut Case)>)> = vec![
                ("base".into(), Box::new(|_| {})),
                ("depth+1".into(), Box::new(|c| c.w.grasp_depth_m += 1e-3)),
                ("depth-1".into(), Box::new(|c| c.w.grasp_depth_m -= 1e-3)),
                ("palm+1".into(), Box::new(|c| c.w.palm_radius_m += 1e-3)),
                (
                    "palm-0.15".into(),
                    Box::new(|c| c.w.palm_radius_m -= 0.15e-3),
                ),
                ("mu+.02".into(), Box::new(|c| c.w.friction += 0.02)),
                ("mu-.02".into(), Box::new(|c| c.w.friction -= 0.02)),
                ("jerk+10".into(), Box::new(|c| c.m.jerk_ramp_s += 0.01)),
                ("jerk-10".into(), Box::new(|c| c.m.jerk_ramp_s -= 0.01)),
                (
                    "az10".into(),
                    Box::new(|c| c.w.first_finger_rad = 10f64.to_radians()),
                ),
                (
                    "az20".into(),
                    Box::new(|c| c.w.first_finger_rad = 20f64.to_radians()),
                ),
                (
                    "az30".into(),
                    Box::new(|c| c.w.first_finger_rad = 30f64.to_radians()),
                ),
                (
                    "az45".into(),
                    Box::new(|c| c.w.first_finger_rad = 45f64.to_radians()),
                ),
                (
                    "az60".into(),
                    Box::new(|c| c.w.first_finger_rad = 60f64.to_radians()),
                ),
                ("dwell.05".into(), Box::new(|c| c.m.dwell_s = 0.05)),
                ("dwell.5".into(), Box::new(|c| c.m.dwell_s = 0.5)),
                ("grip.8".into(), Box::new(|c| c.m.grip_s = 0.8)),
                ("grip2".into(), Box::new(|c| c.m.grip_s = 2.0)),
                ("p-2".into(), Box::new(|c| c.p -= 2.0)),
                ("p+2".into(), Box::new(|c| c.p += 2.0)),
                (
                    "damp*.7".into(),
                    Box::new(|c| {
                        for f in &mut c.w.fingers {
                            f.damping_s *= 0.7
                        }
                    }),
                ),
                (
                    "damp*1.5".into(),
                    Box::new(|c| {
                        for f in &mut c.w.fingers {
                            f.damping_s *= 1.5
                        }
                    }),
                ),
            ];
            for (name, v) in &variants {
                print!("{name:10}");
                for (s, m, a) in GRID {
                    let mut c = case(s, m, a);
                    v(&mut c);
                    let r = run(&c);
                    print!(
                        " {:>8}",
                        if r.outcome == "hold" {
                            format!("h{:.1}", r.slip_max * 1e3)
                        } else {
                            r.outcome.to_string()
                        }
                    );
                }
                println!();
            }
        }
        _ => {
            for (s, m, a) in GRID {
                let r = run(&case(s, m, a));
                println!(
                    "{} {m} g {a} m/s2: {} at {:.3} slip {:.3} mm, {:.1} x real time",
                    if s { "sphere" } else { "cylinder" },
                    r.outcome,
                    r.lost_s,
                    r.slip_end * 1e3,
                    1.0 / r.wall
                );
            }
        }
    }
}
