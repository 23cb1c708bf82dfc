//! Specs with faults from a fixed seed: refused or used, soon and without a panic.

use std::time::{Duration, Instant};
use steradian_testkit::{Mutator, full};

const MOST_TIME: Duration = Duration::from_secs(2);

#[test]
fn damaged_specs_end_well() {
    let specs = [
        "ggx:alpha=0.1,f0=0.9/0.7/0.3",
        "lafortune:cx=-1,cy=-1,cz=0.9,n=20,ks=0.1/0.2/0.3,kd=0.5",
        "lafortune:@skin,scale=0.5",
        "curet:rbrdf.dat,sample=3,angles=a.dat",
        "sgd:gold-metallic-paint",
        "ward:ax=0.1,ay=0.3,variant=duer",
        "oren-nayar:sigma=0.3,albedo=0.8/0.5/0.2,variant=fujii",
    ];
    let mut damage = Mutator::new(1);
    for i in 0..if full() { 2_000_000 } else { 20_000 } {
        let (spec, other) = (specs[i % specs.len()], specs[damage.below(specs.len())]);
        let text = damage.damage(spec.as_bytes(), other.as_bytes());
        let text = String::from_utf8_lossy(&text);
        let start = Instant::now();
        if let Err(e) = steradian_brdf::parse(&text) {
            assert!(!e.to_string().is_empty(), "{text}");
        }
        assert!(start.elapsed() < MOST_TIME, "{text}");
    }
}
