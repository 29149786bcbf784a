// The navigator of planner.py in Rust: MessagePack, by the module beside it.
//
//   rustc -O -o planner planner.rs && clearway check exec:./planner
mod clearway_wire;
use clearway_wire::{number, receive, send, texts, Value};

const CLEARANCE: f64 = 0.7; // m that are kept ahead of the lidar

fn decide(m: &Value, v_max: f64, omega_max: f64) -> (f64, f64) { // turn to the goal, and drive there as the room ahead allows
    let (pose, goal, scan) = (m.get("pose"), m.get("goal"), m.get("scan"));
    let beam = |i: usize| scan.get("angle_min").number + i as f64 * scan.get("angle_increment").number;
    let ahead = scan.get("ranges").array().enumerate().filter(|&(i, _)| beam(i).abs() < 0.6).map(|(_, r)| r);
    let room = ahead.fold(scan.get("range_max").number, f64::min);
    let (dx, dy) = (goal.get("pose").at(0) - pose.at(0), goal.get("pose").at(1) - pose.at(1));
    let near = dx.hypot(dy) < 0.5 * goal.get("xy_tolerance").number;
    let turn = (if near { goal.get("pose").at(2) } else { dy.atan2(dx) }) - pose.at(2);
    let error = turn.sin().atan2(turn.cos());
    let fast = v_max.min(dx.hypot(dy)).min(0.7 * (room - CLEARANCE).max(0.0));
    (if near { 0.0 } else { error.cos().max(0.0) * fast }, (1.5 * error).clamp(-omega_max, omega_max))
}

fn main() {
    let version = vec![1]; // a small whole number is its own MessagePack
    send("hello", &[("version", version), ("needs", texts(&["scan"])), ("drives", texts(&["differential"]))]);
    let (mut v_max, mut omega_max) = (0.0, 0.0);
    while let Some(m) = receive() {
        match &m.get("type").bytes[..] {
            b"reset" => {
                v_max = m.get("task").get("speed_limit").number.min(m.get("limits").get("v_max").number);
                omega_max = m.get("limits").get("omega_max").number;
                send("ready", &[]);
            }
            b"step" => {
                let (v, omega) = decide(&m, v_max, omega_max);
                send("command", &[("v", number(v)), ("omega", number(omega))]);
            }
            _ => break, // bye
        }
    }
}
