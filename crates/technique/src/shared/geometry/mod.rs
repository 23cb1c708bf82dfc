//! The geometry's factor: light transport at sites.

pub mod by_group;
pub mod clustered;
pub mod grouped;
pub mod matrices;
pub mod site_sum;
pub mod transport;
