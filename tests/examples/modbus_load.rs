//! Loads a Modbus TCP server and tells how it copes: `modbus_load PORT FUNCTION START COUNT CLIENTS SECONDS PID NAME`.
//!
//! Every client has one request under way and sends the next as soon as it is answered. Each answer is checked: header,
//! function and length. One line comes out: requests a second, median and 99th percentile of the time from request to
//! answer, and what a request costs the process PID in CPU time.

use std::error::Error;
use std::fs;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

/// Function code 3 or 16 is what there is.
const READ: u8 = 3;
const WARM_UP: Duration = Duration::from_millis(300);

struct Client {
    stream: TcpStream,
    sent: Instant,
    answer: Vec<u8>,
}

struct Load {
    request: Vec<u8>,
    answer_length: usize,
    clients: Vec<Client>,
    times: Vec<u32>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [port, function, start, count, clients, seconds, pid, name] = &arguments[..] else {
        return Err("usage: modbus_load PORT FUNCTION START COUNT CLIENTS SECONDS PID NAME".into());
    };
    let (function, count): (u8, u16) = (function.parse()?, count.parse()?);
    let (request, answer_length) = request(function, start.parse()?, count);
    let connect = |_| {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port.parse()?))?;
        stream.set_nodelay(true)?;
        Ok(Client { stream, sent: Instant::now(), answer: Vec::with_capacity(512) })
    };
    let clients = (0..clients.parse()?).map(connect).collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    let mut load = Load { request, answer_length, clients, times: Vec::with_capacity(1 << 20) };
    load.begin()?;
    load.run(WARM_UP)?;
    load.times.clear();
    let (before, begun) = (cpu_seconds(pid)?, Instant::now());
    load.run(Duration::from_secs_f64(seconds.parse()?))?;
    let (cost, took) = (cpu_seconds(pid)? - before, begun.elapsed().as_secs_f64());
    load.times.sort_unstable();
    let answered = load.times.len() as f64;
    let quantile = |q: f64| f64::from(load.times[((answered - 1.0) * q) as usize]) / 1e3;
    println!(
        "{name:<14} {function:>3} {count:>5} {:>7} {:>9.0} {:>9.1} {:>9.1} {:>11.2}",
        load.clients.len(),
        answered / took,
        quantile(0.5),
        quantile(0.99),
        cost / answered * 1e6
    );
    Ok(())
}

/// A request, and the length of its answer.
fn request(function: u8, start: u16, count: u16) -> (Vec<u8>, usize) {
    let mut pdu = vec![1, function];
    pdu.extend(start.to_be_bytes());
    pdu.extend(count.to_be_bytes());
    if function != READ {
        pdu.push(2 * count as u8);
        pdu.extend((0..count).flat_map(|word| (word % 2 * 7).to_be_bytes()));
    }
    let mut request = vec![0, 1, 0, 0, 0, pdu.len() as u8];
    request.extend(pdu);
    (request, if function == READ { 9 + 2 * usize::from(count) } else { 12 })
}

/// The CPU time of a process so far, in steps of 10 ms.
fn cpu_seconds(pid: &str) -> Result<f64, Box<dyn Error>> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat"))?;
    let fields: Vec<&str> = text.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    Ok((fields[11].parse::<f64>()? + fields[12].parse::<f64>()?) / 100.0)
}

impl Load {
    fn begin(&mut self) -> Result<(), Box<dyn Error>> {
        for client in &mut self.clients {
            client.sent = Instant::now();
            client.stream.write_all(&self.request)?;
        }
        Ok(())
    }

    fn run(&mut self, time: Duration) -> Result<(), Box<dyn Error>> {
        let end = Instant::now() + time;
        let mut chunk = [0; 512];
        while Instant::now() < end {
            let ready: Vec<usize> = {
                let mut fds: Vec<PollFd<'_>> =
                    self.clients.iter().map(|c| PollFd::new(c.stream.as_fd(), PollFlags::POLLIN)).collect();
                if poll(&mut fds, PollTimeout::from(5000_u16))? == 0 {
                    return Err("no answer for five seconds".into());
                }
                fds.iter().enumerate().filter(|(_, fd)| fd.any().unwrap_or(true)).map(|(n, _)| n).collect()
            };
            for number in ready {
                let client = &mut self.clients[number];
                let length = client.stream.read(&mut chunk)?;
                if length == 0 {
                    return Err("the server has closed a connection".into());
                }
                client.answer.extend(&chunk[..length]);
                if client.answer.len() < self.answer_length {
                    continue;
                }
                let is_right = client.answer.len() == self.answer_length
                    && client.answer[..4] == self.request[..4]
                    && client.answer[7] == self.request[7];
                if !is_right {
                    return Err(format!("a wrong answer: {:02X?}", client.answer).into());
                }
                let now = Instant::now();
                self.times.push(u32::try_from((now - client.sent).as_nanos()).unwrap_or(u32::MAX));
                client.answer.clear();
                client.sent = now;
                client.stream.write_all(&self.request)?;
            }
        }
        Ok(())
    }
}
