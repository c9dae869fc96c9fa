//! Real-time dynamics for interactive and immersive environments: the library facade and the tumble command.
