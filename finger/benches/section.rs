//! Cost of the finger model: `cargo bench -p finger`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use finger::hyperelastic::Rubber;
use finger::mesh::MeshSize;
use finger::section::Section;
use finger::yeoh::SectionModel;

/// A section from the middle of `recipes/rtv225.toml`, at 4, 8, … 160 kPa.
fn section(criterion: &mut Criterion) {
    let section = Section {
        outer_radius_m: 9.66e-3,
        bore_radius_m: 4.65e-3,
        bore_offset_m: 2.67e-3,
        flat_half_angle_rad: 56.1f64.to_radians(),
    };
    // The paper's constants, section 3.1.
    let rubber = Rubber::incompressible([0.1e6, 0.02e6, 0.0002e6]);
    let pressures_pa: Vec<f64> = (1..=40).map(|k| 4e3 * f64::from(k)).collect();
    criterion.bench_function("one section at forty pressures", |bencher| {
        bencher.iter(|| {
            SectionModel::new(black_box(&section), rubber, MeshSize::STANDARD)
                .and_then(|model| model.inflate(&pressures_pa))
                .expect("the section does not balloon")
        });
    });
}

criterion_group!(benches, section);
criterion_main!(benches);
