//! The solvers of this build, and how a scene's solver is made.
