//! The same input gives the same bytes, whatever the number of threads.

use onemesh::demo::Sculptor;
use onemesh::pipeline::{Preset, Settings, Subject, register};

#[test]
fn threads_do_not_show_in_a_registration() {
    let sculpted = onemesh::demo::Settings { triangles: 6000, ..Default::default() };
    let subjects: Vec<Subject> = (Sculptor::new(2).with(sculpted).collection(3, &[1.0]).into_iter())
        .map(|head| Subject { name: head.name, mesh: head.mesh, landmarks: head.landmarks })
        .collect();
    let mut settings = Settings::preset(Preset::Default, 2562).unwrap();
    for level in settings.fit.levels.iter_mut().chain(&mut settings.register.levels) {
        level.iterations = 15;
    }
    settings.groupwise.iterations = 1;
    let by = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| register(&subjects, &settings, &()).unwrap().members)
    };
    let alone = by(1);
    for threads in [2, 3, 8] {
        assert!(by(threads) == alone, "{threads} threads");
    }
}
