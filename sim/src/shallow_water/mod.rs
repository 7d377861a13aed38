//! shallow_water
