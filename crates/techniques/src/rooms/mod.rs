//! The rooms. Rooms never import rooms: what two share moves down a layer.

pub mod sh_irradiance;
