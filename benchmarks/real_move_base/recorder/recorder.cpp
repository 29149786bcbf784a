// Plug-ins around the real planners of an unmodified move_base: they hand every call through, and write down what the planner was
// asked, what it saw and what it answered. recording.py reads it.
//
// ~recorder/file    where to
// ~recorder/local   the real local planner, such as base_local_planner/TrajectoryPlannerROS
// ~recorder/global  the real global planner
// ~recorder/every   of its plans, how many go by until one is written (its costmap is large)
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include <base_local_planner/odometry_helper_ros.h>
#include <costmap_2d/costmap_2d_ros.h>
#include <nav_core/base_global_planner.h>
#include <nav_core/base_local_planner.h>
#include <pluginlib/class_list_macros.hpp>
#include <pluginlib/class_loader.hpp>
#include <ros/ros.h>
#include <tf2/utils.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>
#include <tf2_ros/buffer.h>
#include <zlib.h>

namespace clearway_recorder {

using Numbers = std::vector<double>;
using Plan = std::vector<geometry_msgs::PoseStamped>;

std::string setting(const std::string& name) {
  std::string value;
  ros::NodeHandle("~recorder").getParam(name, value);
  return value;
}

// A record: its kind, how many numbers, rows and columns of a costmap, how many bytes follow; then numbers and cells, deflated.
void write(char kind, const Numbers& numbers, const costmap_2d::Costmap2D* map = nullptr) {
  static std::mutex turn;
  std::lock_guard<std::mutex> lock(turn);
  static std::ofstream file(setting("file"), std::ios::binary | std::ios::app);
  const uint32_t rows = map ? map->getSizeInCellsY() : 0, columns = map ? map->getSizeInCellsX() : 0;
  std::vector<unsigned char> bytes(numbers.size() * sizeof(double) + size_t(rows) * columns);
  if (!numbers.empty()) std::memcpy(bytes.data(), numbers.data(), numbers.size() * sizeof(double));
  if (map) std::memcpy(bytes.data() + numbers.size() * sizeof(double), map->getCharMap(), size_t(rows) * columns);
  uLongf size = compressBound(bytes.size());
  std::vector<unsigned char> packed(size);
  compress2(packed.data(), &size, bytes.data(), bytes.size(), 1);
  const uint32_t header[] = {uint32_t(kind), uint32_t(numbers.size()), rows, columns, uint32_t(size)};
  file.write(reinterpret_cast<const char*>(header), sizeof header);
  file.write(reinterpret_cast<const char*>(packed.data()), size);
  file.flush();
}

void add(Numbers& to, const geometry_msgs::Pose& pose) {
  to.insert(to.end(), {pose.position.x, pose.position.y, tf2::getYaw(pose.orientation)});
}

void add(Numbers& to, const costmap_2d::Costmap2D& map) {
  to.insert(to.end(), {map.getOriginX(), map.getOriginY(), map.getResolution()});
}

class LocalPlanner : public nav_core::BaseLocalPlanner {
 public:
  LocalPlanner() : loader_("nav_core", "nav_core::BaseLocalPlanner"), odom_("odom") {}

  void initialize(std::string, tf2_ros::Buffer* tf, costmap_2d::Costmap2DROS* costmap) override {
    tf_ = tf;
    costmap_ = costmap;
    const std::string real = setting("local");
    real_ = loader_.createInstance(real);
    real_->initialize(loader_.getName(real), tf, costmap);
  }

  bool setPlan(const Plan& plan) override {
    Numbers said{ros::Time::now().toSec()};
    for (const auto& pose : plan) add(said, pose.pose);
    write('P', said);
    if (!plan.empty()) frame_ = plan.front().header.frame_id;
    return real_->setPlan(plan);
  }

  bool isGoalReached() override {
    Numbers said = state();
    const bool reached = real_->isGoalReached();
    said.push_back(reached);
    write('R', said);
    return reached;
  }

  bool computeVelocityCommands(geometry_msgs::Twist& command) override {
    Numbers said = state();
    const bool ok = real_->computeVelocityCommands(command);
    const Numbers after = state();
    said.insert(said.end(), {double(ok), command.linear.x, command.angular.z, command.linear.y, double(same(said, after))});
    add(said, *costmap_->getCostmap());
    write('C', said, costmap_->getCostmap());
    return ok;
  }

 private:
  // Time, pose and velocity (v, omega, v_y), and where the plan's frame stands, as the planner is about to read them.
  Numbers state() {
    Numbers said{ros::Time::now().toSec()};
    geometry_msgs::PoseStamped pose, velocity;
    costmap_->getRobotPose(pose);
    add(said, pose.pose);
    odom_.getRobotVel(velocity);
    const auto& speed = velocity.pose;
    said.insert(said.end(), {speed.position.x, tf2::getYaw(speed.orientation), speed.position.y});
    geometry_msgs::Pose frame;
    frame.orientation.w = 1.0;
    try {
      if (!frame_.empty()) {
        const auto found = tf_->lookupTransform(costmap_->getGlobalFrameID(), frame_, ros::Time(0)).transform;
        frame.position.x = found.translation.x;
        frame.position.y = found.translation.y;
        frame.orientation = found.rotation;
      }
    } catch (const tf2::TransformException&) {
    }
    add(said, frame);
    return said;
  }

  // Whether pose and velocity stayed as they were: nothing came while the planner was at work.
  static bool same(const Numbers& before, const Numbers& after) {
    return std::equal(before.begin() + 1, before.begin() + 7, after.begin() + 1);
  }

  pluginlib::ClassLoader<nav_core::BaseLocalPlanner> loader_;
  base_local_planner::OdometryHelperRos odom_;
  boost::shared_ptr<nav_core::BaseLocalPlanner> real_;
  tf2_ros::Buffer* tf_ = nullptr;
  costmap_2d::Costmap2DROS* costmap_ = nullptr;
  std::string frame_;
};

class GlobalPlanner : public nav_core::BaseGlobalPlanner {
 public:
  GlobalPlanner() : loader_("nav_core", "nav_core::BaseGlobalPlanner") {}

  void initialize(std::string, costmap_2d::Costmap2DROS* costmap) override {
    costmap_ = costmap;
    ros::NodeHandle("~recorder").getParam("every", every_);
    const std::string real = setting("global");
    real_ = loader_.createInstance(real);
    real_->initialize(loader_.getName(real), costmap);
  }

  bool makePlan(const geometry_msgs::PoseStamped& start, const geometry_msgs::PoseStamped& goal, Plan& plan) override {
    if (count_++ % every_ != 0) return real_->makePlan(start, goal, plan);
    const costmap_2d::Costmap2D before(*costmap_->getCostmap());  // a planner frees the robot's cell in it
    const bool ok = real_->makePlan(start, goal, plan);
    Numbers said{ros::Time::now().toSec()};
    add(said, start.pose);
    add(said, goal.pose);
    add(said, before);
    said.push_back(ok);
    for (const auto& pose : plan) add(said, pose.pose);
    write('G', said, &before);
    return ok;
  }

 private:
  pluginlib::ClassLoader<nav_core::BaseGlobalPlanner> loader_;
  boost::shared_ptr<nav_core::BaseGlobalPlanner> real_;
  costmap_2d::Costmap2DROS* costmap_ = nullptr;
  int every_ = 10, count_ = 0;
};

}  // namespace clearway_recorder

PLUGINLIB_EXPORT_CLASS(clearway_recorder::LocalPlanner, nav_core::BaseLocalPlanner)
PLUGINLIB_EXPORT_CLASS(clearway_recorder::GlobalPlanner, nav_core::BaseGlobalPlanner)
