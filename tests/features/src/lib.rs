//! Empty. The dependencies of this package fix the features that all builds of a checkout share.
