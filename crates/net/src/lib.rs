//! Recording (MCAP with the Foxglove schemas) and, later, the NetSync sessions of tumble.
