//! The server: one frame after the other, at the given rate.

use super::facet::{END, PRESENT, PRESENTED, READY, STATE, word, words};
use super::options::Options;
use super::report::{Figures, print};
use super::{Failure, clock_ns};
use std::time::{Duration, Instant};
use tumble_net::sync::cpu_latency::CpuLatencyRequest;
use tumble_net::sync::shm::ShmServer;
use tumble_net::sync::transport::{Delivery, FacetNumber, LinkEvent, ServerLink};
use tumble_net::sync::udp::{SharedKey, Timing, UdpServer};

fn serve(options: &Options) -> Result<Box<dyn ServerLink>, Failure> {
    if options.transport == "shm" {
        println!("shared memory, run {}", options.run);
        return Ok(Box::new(ShmServer::new(&options.run, options.facets)?));
    }
    let key = options.key.as_deref().map(SharedKey::read).transpose()?;
    let server = UdpServer::bind(options.address, options.facets, key, Timing::default())?;
    println!("{}", server.describe());
    Ok(Box::new(server))
}

struct Run {
    link: Box<dyn ServerLink>,
    all: Vec<FacetNumber>,
    message: Vec<u8>,
    figures: Figures,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let all: Vec<FacetNumber> = (0..options.facets).collect();
    let mut run = Run { link: serve(options)?, all, message: Vec::new(), figures: Figures::default() };
    let _awake = options.stay_awake.then(CpuLatencyRequest::ask).transpose()?;
    run.wait_for_facets()?;
    let before = run.bytes();
    let begin = Instant::now();
    let mut state = vec![0; options.bytes];
    for frame in 0..options.frames {
        let due = begin + Duration::from_secs_f64(frame as f64 / options.rate);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if Instant::now() > due + Duration::from_secs_f64(1.0 / options.rate) {
            run.figures.behind += 1;
        }
        run.frame(frame, &mut state)?;
    }
    run.figures.wall = begin.elapsed();
    let bytes = run.bytes() - before;
    run.link.send_all(&run.all, Delivery::Reliable, &words(&[END, 0]))?;
    let _ = run.link.recv(Duration::from_millis(300), &mut run.message);
    let counters: Vec<_> = run.all.iter().map(|facet| run.link.counters(*facet)).collect();
    print(options, &mut run.figures, bytes, &counters)
}

impl Run {
    fn wait_for_facets(&mut self) -> Result<(), Failure> {
        let end = Instant::now() + Duration::from_secs(20);
        let mut open = 0;
        while open < self.all.len() {
            if let Some((_, LinkEvent::Opened)) = self.link.recv(Duration::from_millis(100), &mut self.message)? {
                open += 1;
            }
            if Instant::now() > end {
                return Err(format!("{open} of {} facets came within 20 s", self.all.len()).into());
            }
        }
        Ok(())
    }

    /// Runs a frame: STATE, all READY, PRESENT, all PRESENTED.
    fn frame(&mut self, frame: u64, state: &mut [u8]) -> Result<(), Failure> {
        let tail = state.len() - 8;
        state[tail..].copy_from_slice(&frame.to_le_bytes());
        let sent = clock_ns();
        state[..24].copy_from_slice(&words(&[STATE, frame, sent]));
        self.link.send_all(&self.all, Delivery::Reliable, state)?;
        for message in self.replies(READY, frame)? {
            self.figures.state_ns.push(word(&message, 2));
            self.figures.faults = self.figures.faults.max(word(&message, 3));
        }
        self.figures.ready_ns.push(clock_ns().saturating_sub(sent));
        self.link.send_all(&self.all, Delivery::Reliable, &words(&[PRESENT, frame]))?;
        let shown: Vec<u64> = self.replies(PRESENTED, frame)?.iter().map(|message| word(message, 2)).collect();
        let (first, last) = (shown.iter().min().copied().unwrap_or(sent), shown.iter().max().copied().unwrap_or(sent));
        self.figures.barrier_ns.push(last.saturating_sub(sent));
        self.figures.skew_ns.push(last - first);
        Ok(())
    }

    /// Returns one reply of each facet.
    fn replies(&mut self, kind: u64, frame: u64) -> Result<Vec<Vec<u8>>, Failure> {
        let mut replies = Vec::new();
        let end = Instant::now() + Duration::from_secs(10);
        while replies.len() < self.all.len() {
            match self.link.recv(Duration::from_secs(1), &mut self.message)? {
                Some((_, LinkEvent::Message)) if (word(&self.message, 0), word(&self.message, 1)) == (kind, frame) => {
                    replies.push(self.message.clone())
                }
                Some((facet, event)) => {
                    let what = (word(&self.message, 0), word(&self.message, 1));
                    return Err(format!(
                        "frame {frame}: facet {facet}: {event:?} {what:?} instead of {:?}",
                        (kind, frame)
                    )
                    .into());
                }
                None if Instant::now() > end => {
                    return Err(
                        format!("frame {frame}: {} of {} facets answered", replies.len(), self.all.len()).into()
                    );
                }
                None => {}
            }
        }
        Ok(replies)
    }

    fn bytes(&self) -> u64 {
        self.all
            .iter()
            .map(|facet| self.link.counters(*facet))
            .map(|counters| counters.bytes_in + counters.bytes_out)
            .sum()
    }
}
