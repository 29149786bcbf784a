// Feeds recorded inputs to nav2_regulated_pure_pursuit_controller and writes what it makes of them, a line each:
// how it ends (0: a command, 1: off the costmap, 2: no valid control), speed, yaw rate, whether cancelling is finished.
#include <fstream>
#include "ros.hpp"
#define protected public
#define private public
#include "nav2_regulated_pure_pursuit_controller/regulated_pure_pursuit_controller.hpp"
#undef private
#undef protected

struct Checker : nav2_core::GoalChecker {
  bool there{false};
  void initialize(const nav2::LifecycleNode::WeakPtr &, const std::string &, const std::shared_ptr<nav2_costmap_2d::Costmap2DROS>) override {}
  void reset() override {}
  bool isGoalReached(const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Twist &, const nav_msgs::msg::Path &) override { return false; }
  bool isGoalXYReached(const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Twist &, const nav_msgs::msg::Path &) override { return there; }
  bool getTolerances(geometry_msgs::msg::Pose &, geometry_msgs::msg::Twist &, double &) override { return true; }
};

template<typename T> T get(std::istream & in) { T v; in >> v; if (!in) { throw std::runtime_error("input"); } return v; }
geometry_msgs::msg::Pose pose_of(std::istream & in) {
  geometry_msgs::msg::Pose p; p.position.x = get<double>(in); p.position.y = get<double>(in);
  p.orientation = nav2_util::geometry_utils::orientationAroundZAxis(get<double>(in)); return p;
}
geometry_msgs::msg::Twist twist_of(std::istream & in) {
  geometry_msgs::msg::Twist t; t.linear.x = get<double>(in); t.angular.z = get<double>(in); return t;
}

int main(int, char ** argv) {
  std::ifstream in(argv[1]); FILE * out = fopen(argv[2], "w");
  for (int cases = get<int>(in); cases > 0; --cases) {
    std::string line;
    given().clear();
    for (int n = get<int>(in), i = (std::getline(in, line), 0); i < n; ++i) {
      std::getline(in, line); const auto at = line.find('='); given()[line.substr(0, at)] = line.substr(at + 1);
    }
    auto node = std::make_shared<nav2::LifecycleNode>();
    auto costmap = std::make_shared<nav2_costmap_2d::Costmap2DROS>();
    auto tf = std::make_shared<nav2::TransformBuffer>();
    auto & map = costmap->map;
    map.ny = get<unsigned>(in); map.nx = get<unsigned>(in); map.ox = get<double>(in); map.oy = get<double>(in); map.resolution_ = get<double>(in);
    costmap->layered.inscribed = get<double>(in); costmap->layered.circumscribed = get<double>(in);
    costmap->layered.unknown = get<int>(in);
    for (int n = get<int>(in), i = 0; i < n; ++i) { geometry_msgs::msg::Point p; p.x = get<double>(in); p.y = get<double>(in); costmap->footprint.push_back(p); }
    map.cells.resize(map.nx * map.ny);
    for (auto & c : map.cells) { c = static_cast<unsigned char>(get<int>(in)); }
    nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController controller;
    controller.configure(node, "FollowPath", tf, costmap);
    controller.activate();
    Checker checker; checker.there = get<int>(in);
    if (get<int>(in)) { controller.cancel(); }
    if (const double limit = get<double>(in); limit > 0) { controller.setSpeedLimit(limit, true); }
    geometry_msgs::msg::PoseStamped pose; pose.pose = pose_of(in); tf->robot = pose.pose;
    const auto measured = twist_of(in); controller.last_command_velocity_ = twist_of(in);
    nav_msgs::msg::Path path;
    for (int n = get<int>(in), i = 0; i < n; ++i) { geometry_msgs::msg::PoseStamped s; s.pose = pose_of(in); path.poses.push_back(s); }
    int end = 0; geometry_msgs::msg::TwistStamped command;
    try { command = controller.computeVelocityCommands(pose, measured, &checker, path, path.poses.back()); }
    catch (const nav2_core::NoValidControl &) { end = 2; }
    catch (const nav2_core::ControllerException &) { end = 1; }
    fprintf(out, "%d %.17g %.17g %d\n", end, command.twist.linear.x, command.twist.angular.z, int(controller.finished_cancelling_));
  }
  fclose(out);
}
