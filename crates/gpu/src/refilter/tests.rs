//! Shaders validate and plans hold together, without any adapter.

use super::program::Pass;
use super::resources::SHADERS;
use super::{Level, Method, Plan, ggx_levels};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use steradian_techniques::gpu::Kernel;

#[test]
fn shaders_validate_without_an_adapter() {
    let module = match naga::front::wgsl::parse_str(SHADERS) {
        Ok(m) => m,
        Err(e) => panic!("{}", e.emit_to_string(SHADERS)),
    };
    if let Err(e) = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module) {
        panic!("{}", e.emit_to_string(SHADERS));
    }
    for pass in Pass::ALL {
        assert!(module.entry_points.iter().any(|e| e.name == pass.entry()), "{pass:?}");
        assert_eq!(Pass::ALL[pass as usize], pass);
    }
}

/// Every output of every job is in exactly one tile, but for the threads that fill a last workgroup.
#[test]
fn tiles_cover_their_jobs() {
    for way in [Method::Box, Method::Convolution, Method::Paraboloid, Method::Frequency] {
        let plan = Plan::new(way, &ggx_levels(64, 4)).expect("good levels");
        for (k, job) in plan.work.jobs.iter().enumerate() {
            let mut next = 0;
            for tile in plan.work.tiles.iter().filter(|t| t.job == k) {
                assert_eq!(tile.first, next);
                next += 64 * u64::from(tile.groups);
            }
            assert!((job.outputs..job.outputs + 64).contains(&next), "{job:?}");
        }
        let all: u64 = plan.reads().iter().map(|r| r.2).sum();
        assert_eq!(all, plan.work.tiles.iter().map(|t| t.reads).sum::<u64>());
    }
}

#[test]
fn convolution_predicts_less_than_a_percent() {
    for count in [6, 10] {
        let plan = Plan::new(Method::Convolution, &ggx_levels(256, count)).expect("good levels");
        assert!(plan.predicted().iter().all(|e| *e < 4e-3), "{:?}", plan.predicted());
    }
}

/// Green, Kautz & Durand's chain, whose widths double from a degree.
#[test]
fn gaussians_are_predicted_well() {
    let level = |k: i32| Level {
        size: (128 >> k).max(16),
        kernel: Kernel::Gaussian { sigma: 1f64.to_radians() * f64::from(1 << k) },
        gain: 1.0,
    };
    let levels: Vec<Level> = (0..7).map(level).collect();
    let plan = Plan::new(Method::Convolution, &levels).expect("good levels");
    println!("{:?}", plan.predicted());
    assert!(plan.predicted().iter().all(|e| *e < 0.01), "{:?}", plan.predicted());
}

#[test]
fn what_is_no_chain_is_an_error() {
    let level = |size, kernel| Level { size, kernel, gain: 1.0 };
    let ggx = |alpha| Kernel::Ggx { alpha };
    let phong = |n| Kernel::Phong { n };
    for bad in [
        vec![],
        vec![level(0, Kernel::Mirror)],
        vec![level(4096, Kernel::Lambert)],
        vec![level(8, ggx(0.0))],
        vec![level(8, ggx(f64::NAN))],
        vec![level(8, phong(0.5))],
        vec![Level { size: 8, kernel: Kernel::Mirror, gain: f32::INFINITY }],
    ] {
        assert!(Plan::new(Method::Convolution, &bad).is_err(), "{bad:?}");
    }
}
