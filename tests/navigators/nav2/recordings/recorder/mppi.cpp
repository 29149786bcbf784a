// Feeds recorded inputs to nav2_mppi_controller's optimizer and writes what it makes of them.
#include <Eigen/Dense>
#include <condition_variable>
#include <fstream>
#include <random>
#include <thread>
#include "ros.hpp"
#define protected public
#define private public
#include "nav2_mppi_controller/optimizer.hpp"
#undef private
#undef protected

struct Checker : nav2_core::GoalChecker {
  double xy{0.25};
  void initialize(const nav2::LifecycleNode::WeakPtr &, const std::string &, const std::shared_ptr<nav2_costmap_2d::Costmap2DROS>) override {}
  void reset() override {}
  bool isGoalReached(const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Twist &, const nav_msgs::msg::Path &) override { return false; }
  bool isGoalXYReached(const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Twist &, const nav_msgs::msg::Path &) override { return false; }
  bool getTolerances(geometry_msgs::msg::Pose & p, geometry_msgs::msg::Twist &, double &) override { p.position.x = xy; return true; }
};

template<typename T> T get(std::istream & in) { T v; in >> v; if (!in) { throw std::runtime_error("input"); } return v; }
geometry_msgs::msg::Pose pose_of(double x, double y, double yaw) {
  geometry_msgs::msg::Pose p; p.position.x = x; p.position.y = y;
  tf2::Quaternion q; q.setRPY(0, 0, yaw); p.orientation = tf2::toMsg(q); return p;
}
template<typename A> void write(std::ofstream & out, const A & a) {  // (samples, steps) column by column: (steps, samples)
  out.write(reinterpret_cast<const char *>(a.data()), sizeof(float) * a.size());
}
int main(int, char ** argv) {
  std::ifstream in(argv[1]); std::ofstream out(argv[2], std::ios::binary);
  std::string line;
  for (int n = get<int>(in), i = (std::getline(in, line), 0); i < n; ++i) {
    std::getline(in, line); const auto at = line.find('='); given()[line.substr(0, at)] = line.substr(at + 1);
  }
  auto node = std::make_shared<nav2::LifecycleNode>();
  auto costmap = std::make_shared<nav2_costmap_2d::Costmap2DROS>();
  auto & map = costmap->map;
  map.ny = get<unsigned>(in); map.nx = get<unsigned>(in); map.ox = get<double>(in); map.oy = get<double>(in); map.resolution_ = get<double>(in);
  costmap->layered.inscribed = get<double>(in); costmap->layered.circumscribed = get<double>(in);
  const double scaling = get<double>(in), radius = get<double>(in);
  costmap->layered.unknown = get<int>(in); costmap->use_radius = get<int>(in);
  if (radius > 0) {
    costmap->inflation = std::make_shared<nav2_costmap_2d::InflationLayerInterface>();
    *costmap->inflation = {scaling, radius, map.resolution_, costmap->layered.inscribed};
  }
  for (int n = get<int>(in), i = 0; i < n; ++i) { geometry_msgs::msg::Point p; p.x = get<double>(in); p.y = get<double>(in); costmap->footprint.push_back(p); }
  map.cells.resize(map.nx * map.ny);
  for (auto & c : map.cells) { c = static_cast<unsigned char>(get<int>(in)); }
  mppi::ParametersHandler handler;
  mppi::Optimizer optimizer;
  optimizer.initialize(node, "FollowPath", costmap, nullptr, &handler);
  Checker checker; checker.xy = get<double>(in);
  const double limit = get<double>(in);
  if (limit > 0) { optimizer.setSpeedLimit(limit, true); }
  const int decisions = get<int>(in);
  std::ifstream noise(argv[3], std::ios::binary);
  auto & g = optimizer.noise_generator_;
  for (auto * a : {&g.noises_vx_, &g.noises_vy_, &g.noises_wz_}) {
    a->resize(optimizer.settings_.batch_size, optimizer.settings_.time_steps);
    noise.read(reinterpret_cast<char *>(a->data()), sizeof(float) * a->size());
  }
  for (int k = 0; k < decisions; ++k) {
    geometry_msgs::msg::PoseStamped pose; double v[3], p[3];
    for (auto & x : p) { x = get<double>(in); } for (auto & x : v) { x = get<double>(in); }
    pose.pose = pose_of(p[0], p[1], p[2]);
    geometry_msgs::msg::Twist speed; speed.linear.x = v[0]; speed.linear.y = v[1]; speed.angular.z = v[2];
    nav_msgs::msg::Path path;
    for (int n = get<int>(in), i = 0; i < n; ++i) {
      geometry_msgs::msg::PoseStamped s; const double x = get<double>(in), y = get<double>(in), yaw = get<double>(in);
      s.pose = pose_of(x, y, yaw); path.poses.push_back(s);
    }
    float failed = 0; geometry_msgs::msg::TwistStamped command;
    try {
      command = std::get<0>(optimizer.evalControl(pose, speed, path, path.poses.back().pose, &checker));
    } catch (const nav2_core::NoValidControl &) { failed = 1; }
    const float head[] = {failed, float(command.twist.linear.x), float(command.twist.linear.y), float(command.twist.angular.z)};
    out.write(reinterpret_cast<const char *>(head), sizeof head);
    if (failed) { continue; }
    write(out, optimizer.generated_trajectories_.x); write(out, optimizer.generated_trajectories_.y);
    write(out, optimizer.generated_trajectories_.yaws);
    for (const auto & critic : optimizer.critic_manager_.critic_costs_) { write(out, critic.second); }
    write(out, optimizer.costs_);
    write(out, optimizer.control_sequence_.vx); write(out, optimizer.control_sequence_.vy); write(out, optimizer.control_sequence_.wz);
  }
}
