//! The geometry's factor: light transport at sites.

pub mod clustered;
pub mod matrices;
pub mod site_sum;
pub mod transport;
