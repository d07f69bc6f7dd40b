//! Many simultaneous runs, and many malicious requests.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use super::ball;
use crate::program::{Place, folder};

fn start(here: &Path, line: &str) -> Child {
    let mut command = here.command(line);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs")
}

#[test]
fn sixty_four_simultaneous_runs_all_get_their_image() {
    let folder = folder(&ball("kr: 0.2"));
    let start = |i| start(&folder, &format!("scene.ron -t 2 -q -o {i}.png"));
    let children: Vec<Child> = (0..64).map(start).collect();
    for child in children {
        let output = child.wait_with_output().expect("its end");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let first = folder.bytes("0.png");
    assert!((1..64).all(|i| folder.bytes(&format!("{i}.png")) == first));
}

/// The last writer wins, and files are replaced atomically.
#[test]
fn concurrent_renderings_to_one_output_leave_one_complete_image() {
    let here = folder(&ball("kr: 0.2"));
    let lines = ["scene.ron -q -o a.exr --seed 1", "scene.ron -q -o a.exr --seed 2"];
    let alone = lines.map(|line| {
        here.out(line);
        here.bytes("a.exr")
    });
    assert_ne!(alone[0], alone[1]);
    for _ in 0..10 {
        for child in lines.map(|line| start(&here, line)) {
            assert!(child.wait_with_output().expect("its end").status.success());
        }
        assert!(alone.contains(&here.bytes("a.exr")));
    }
    assert_eq!(std::fs::read_dir(&here).expect("a folder").count(), 2, "nothing else is left");
}

/// Malicious requests, each different.
fn bad_request(number: usize, token: &str) -> Vec<u8> {
    let long = "a".repeat(number * 67 % 20_000);
    let host = "Host: localhost\r\nConnection: close\r\n\r\n";
    match number % 10 {
        0 => format!("GET /status HTTP/1.1\r\n{host}").into_bytes(),
        1 => format!("GET /status?token={long} HTTP/1.1\r\n{host}").into_bytes(),
        2 => format!("GET /status?token={token} HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")
            .into_bytes(),
        3 => format!("GET /image?token={token}&layer={long}&exposure=nan HTTP/1.1\r\n{host}").into_bytes(),
        4 => format!("GET /pixel?token={token}&x=4294967295&y={number} HTTP/1.1\r\n{host}").into_bytes(),
        5 => format!("GET /explain?token={token}&x=-1&y=1e9&sample={number} HTTP/1.1\r\n{host}").into_bytes(),
        6 => {
            let body = format!("{{\"settings\": {{\"spp\": {number}e9, \"{long}\": 1}}}}");
            let head = format!("POST /do?token={token} HTTP/1.1\r\nContent-Length: {}\r\n", body.len());
            format!("{head}{host}{body}").into_bytes()
        }
        7 => format!("GET /../../etc/passwd?token={token} HTTP/1.1\r\n{host}").into_bytes(),
        8 => (0..number).map(|i| (i * 31 + number) as u8).collect(),
        _ => format!("POST /do?token={token} HTTP/1.1\r\nContent-Length: 99999999\r\n{host}{{").into_bytes(),
    }
}

#[test]
fn page_survives_a_thousand_bad_requests() {
    let folder = folder(&ball(""));
    let mut child = start(&folder, "view scene.ron --no-open -t 1");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("an address");
    let (base, token) = line.trim().split_once("/?token=").expect("a token");
    let place = base.trim_start_matches("http://");
    let ask = |request: &[u8], patience: Duration| {
        let mut stream = TcpStream::connect(place).expect("a connection");
        stream.set_read_timeout(Some(patience)).expect("a time");
        let mut answer = Vec::new();
        // The program may close the connection before it has read everything.
        let _ = stream.write_all(request).and_then(|()| stream.read_to_end(&mut answer));
        String::from_utf8_lossy(&answer).into_owned()
    };
    for number in 0..1000 {
        let answer = ask(&bad_request(number, token), Duration::from_millis(20));
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 4"), "{number}: {answer}");
    }
    let good = format!("GET /status?token={token} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    let answer = ask(good.as_bytes(), Duration::from_secs(20));
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    child.kill().expect("to end it");
    let said = child.wait_with_output().expect("its end");
    assert!(!String::from_utf8_lossy(&said.stderr).contains("panicked"));
}
