//! Is a mesh file a clean manifold?
