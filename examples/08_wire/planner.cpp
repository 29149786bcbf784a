// The navigator of planner.py in C++: MessagePack, by the header beside it.
//
//   g++ -O2 -std=c++17 -o planner planner.cpp && clearway check exec:./planner
#include <algorithm>
#include <cmath>

#include "clearway_wire.hpp"

constexpr double kClearance = 0.7;  // m that are kept ahead of the lidar

double room_ahead(const clearway::Value& scan) {  // how far the lidar sees within 35 degrees of straight ahead, m
  const std::vector<double> ranges = scan["ranges"].array();
  double room = scan["range_max"].number;
  for (std::size_t i = 0; i < ranges.size(); ++i)
    if (std::abs(scan["angle_min"].number + i * scan["angle_increment"].number) < 0.6) room = std::min(room, ranges[i]);
  return room;
}

int main() {
  clearway::send("hello", {{"version", std::string(1, 1)},  // a small whole number is its own MessagePack
                           {"needs", clearway::pack(std::vector<std::string>{"scan"})},
                           {"drives", clearway::pack(std::vector<std::string>{"differential"})}});
  double v_max = 0.0, omega_max = 0.0;
  for (clearway::Value m; clearway::receive(m);) {
    const std::string type = m["type"].bytes;
    if (type == "bye") break;
    if (type == "reset") {
      v_max = std::min(m["task"]["speed_limit"].number, m["limits"]["v_max"].number);
      omega_max = m["limits"]["omega_max"].number;
      clearway::send("ready", {});
    } else if (type == "step") {  // turn to the goal and drive there, as fast as the room ahead allows
      const clearway::Value &pose = m["pose"], &goal = m["goal"];
      const double dx = goal["pose"][0] - pose[0], dy = goal["pose"][1] - pose[1], away = std::hypot(dx, dy);
      const bool near = away < 0.5 * goal["xy_tolerance"].number;
      const double heading = near ? goal["pose"][2] : std::atan2(dy, dx);
      const double error = std::remainder(heading - pose[2], 2.0 * M_PI);
      const double fast = std::min({v_max, away, 0.7 * std::max(0.0, room_ahead(m["scan"]) - kClearance)});
      const double v = near ? 0.0 : std::max(0.0, std::cos(error)) * fast;
      const double omega = std::clamp(1.5 * error, -omega_max, omega_max);
      clearway::send("command", {{"v", clearway::pack(v)}, {"omega", clearway::pack(omega)}});
    }
  }
}
