//! The number of datagrams that are decoded, by sender: a flood of one sender takes nothing from
//! the others.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

/// Maximum number of datagrams of one sender that are decoded in each window.
pub const MAX_PER_WINDOW: u32 = 500;
/// Length of a window.
pub const WINDOW: Duration = Duration::from_millis(100);
/// Maximum number of senders in a window. Senders whose messages were applied lately have their
/// places, so that a flood from many ports does not displace them.
const MAX_SENDERS: usize = 256;
/// Time after its last applied message for which a sender keeps its place.
const PLACE_TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Default)]
struct Sender {
    /// Datagrams in this window.
    count: u32,
    /// Time of the last applied message.
    applied: Option<Duration>,
}

/// Budgets of all senders. A sender is an address with a port.
#[derive(Default)]
pub struct SenderBudgets {
    senders: BTreeMap<SocketAddr, Sender>,
    /// Begin of the window.
    since: Duration,
}

impl SenderBudgets {
    /// Counts a datagram and returns whether it may be decoded.
    pub fn admit(&mut self, now: Duration, from: SocketAddr) -> bool {
        if now >= self.since + WINDOW {
            self.since = now;
            self.senders.retain(|_, sender| {
                sender.count = 0;
                sender.applied.is_some_and(|at| now < at + PLACE_TIMEOUT)
            });
        }
        if self.senders.len() >= MAX_SENDERS && !self.senders.contains_key(&from) {
            return false;
        }
        let sender = self.senders.entry(from).or_default();
        sender.count = sender.count.saturating_add(1);
        sender.count <= MAX_PER_WINDOW
    }

    /// Notes that a message of this sender was applied.
    pub fn applied(&mut self, now: Duration, from: SocketAddr) {
        if let Some(sender) = self.senders.get_mut(&from) {
            sender.applied = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    #[test]
    fn each_sender_has_its_own_budget() {
        let mut budgets = SenderBudgets::default();
        let of = |budgets: &mut SenderBudgets, now, port| (0..600).filter(|_| budgets.admit(now, at(port))).count();
        assert_eq!([1, 2, 1].map(|port| of(&mut budgets, Duration::ZERO, port)), [500, 500, 0]);
        assert_eq!(of(&mut budgets, WINDOW, 1), 500);
    }

    #[test]
    fn a_flood_from_many_ports_takes_no_place_of_a_known_sender() {
        let mut budgets = SenderBudgets::default();
        assert!(budgets.admit(Duration::ZERO, at(1)));
        budgets.applied(Duration::ZERO, at(1));
        let mut now = Duration::ZERO;
        for port in 2..20_000 {
            now += Duration::from_micros(50);
            budgets.admit(now, at(port));
            assert!(port % 400 > 0 || budgets.admit(now, at(1)), "{port}");
            assert!(budgets.senders.len() <= MAX_SENDERS);
        }
        // a sender that stays silent gives its place back
        assert!(budgets.admit(PLACE_TIMEOUT + now, at(2)) && budgets.senders.len() == 1);
    }
}
