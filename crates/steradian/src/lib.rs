//! Environment-map lighting of any reflectance: the facade.
