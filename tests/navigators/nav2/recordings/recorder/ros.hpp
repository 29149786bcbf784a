// Just enough of ROS 2 for the cores of Nav2's controllers to compile: plain structs, a parameter table, a plug-in table.
#ifndef ROS_HPP_
#define ROS_HPP_
#include <math.h>  // as rclcpp's logging does with stdlib.h: without them `abs` of a double is that of an int
#include <stdlib.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace std_msgs::msg { struct Header { std::string frame_id; double stamp{0}; }; struct Bool { bool data; }; struct ColorRGBA { float r, g, b, a; }; }
namespace builtin_interfaces::msg { using Time = double; }
namespace rclcpp {
struct Logger {};
inline Logger get_logger(const std::string &) { return {}; }
struct Time { Time(double = 0) {} Time(int, int) {} operator double() const { return 0.0; } };
struct Duration { static double from_seconds(double s) { return s; } };
struct Clock { using SharedPtr = std::shared_ptr<Clock>; Time now() { return {}; } };
struct Parameter {
  std::string name; std::string get_name() const { return name; } double as_double() const { return 0; }
  bool as_bool() const { return false; } int get_type() const { return 0; }
};
struct ParameterValue { template<typename T> explicit ParameterValue(T) {} };
namespace node_interfaces {
struct PostSetParametersCallbackHandle { using SharedPtr = std::shared_ptr<PostSetParametersCallbackHandle>; };
struct OnSetParametersCallbackHandle { using SharedPtr = std::shared_ptr<OnSetParametersCallbackHandle>; };
}
}
#define RCLCPP_INFO(...) do {} while (0)
#define RCLCPP_WARN(...) do {} while (0)
#define RCLCPP_WARN_THROTTLE(...) do {} while (0)
#define RCLCPP_ERROR(...) do {} while (0)
#define RCLCPP_FATAL(...) do {} while (0)
#define RCLCPP_INFO_STREAM(l, s) do {} while (0)
namespace rcl_interfaces::msg {
struct SetParametersResult { bool successful; std::string reason; };
struct ParameterType { static constexpr int PARAMETER_DOUBLE = 1, PARAMETER_BOOL = 2; };
}

namespace geometry_msgs::msg {
struct Point { double x{0}, y{0}, z{0}; };
struct Vector3 { double x{0}, y{0}, z{0}; };
struct PointStamped { std_msgs::msg::Header header; Point point; };
struct Quaternion { double x{0}, y{0}, z{0}, w{1}; };
struct Pose { Point position; Quaternion orientation; };
struct PoseStamped { std_msgs::msg::Header header; Pose pose; };
struct Twist { Vector3 linear, angular; };
struct TwistStamped { std_msgs::msg::Header header; Twist twist; };
}
namespace nav_msgs::msg {
struct Path { std_msgs::msg::Header header; std::vector<geometry_msgs::msg::PoseStamped> poses; };
struct TrajectoryPoint { std_msgs::msg::Header header; geometry_msgs::msg::Pose pose; geometry_msgs::msg::Twist velocity; };
struct Trajectory { std_msgs::msg::Header header; std::vector<TrajectoryPoint> points; };
}
namespace nav2_msgs::msg {
struct CriticsStats { double stamp; std::vector<std::string> critics; std::vector<bool> changed; std::vector<float> costs_sum; };
}
namespace visualization_msgs::msg {
struct Marker {
  std_msgs::msg::Header header; std::string ns; int id, type, action; geometry_msgs::msg::Pose pose;
  geometry_msgs::msg::Vector3 scale; std_msgs::msg::ColorRGBA color; static constexpr int SPHERE = 0, ADD = 0;
};
}
namespace tf2 {
struct Quaternion {
  double z_{0}, w_{1};
  void setRPY(double, double, double yaw) { z_ = std::sin(yaw / 2); w_ = std::cos(yaw / 2); }
  double x() const { return 0; } double y() const { return 0; } double z() const { return z_; } double w() const { return w_; }
};
inline geometry_msgs::msg::Quaternion toMsg(const Quaternion & q) { return {0, 0, q.z_, q.w_}; }
inline double getYaw(const geometry_msgs::msg::Quaternion & q) {
  return std::atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z));
}
}
namespace angles {
inline double normalize_angle(double a) {
  const double r = std::fmod(a + M_PI, 2.0 * M_PI);
  return r <= 0.0 ? r + M_PI : r - M_PI;
}
inline double shortest_angular_distance(double from, double to) { return normalize_angle(to - from); }
}

inline std::map<std::string, std::string> & given() { static std::map<std::string, std::string> m; return m; }

namespace nav2 {
template<typename M> struct Publisher { void on_activate() {} void on_deactivate() {} void publish(std::unique_ptr<M>) {} using SharedPtr = std::shared_ptr<Publisher>; };
struct LifecycleNode {
  using SharedPtr = std::shared_ptr<LifecycleNode>; using WeakPtr = std::weak_ptr<LifecycleNode>;
  rclcpp::Logger get_logger() { return {}; }
  std::shared_ptr<rclcpp::Clock> get_clock() { return std::make_shared<rclcpp::Clock>(); }
  template<typename M> std::shared_ptr<Publisher<M>> create_publisher(const std::string &) { return std::make_shared<Publisher<M>>(); }
  void get_parameter(const std::string & name, double & v) { v = declare_or_get_parameter<double>(name); }
  template<typename T> T declare_or_get_parameter(const std::string & name) {
    const auto it = given().find(name);
    if (it == given().end()) { throw std::runtime_error(name); }
    if constexpr (std::is_same_v<T, bool>) { return it->second == "true"; } else { return std::stod(it->second); }
  }
  template<typename T> T declare_or_get_parameter(const std::string & name, T usual) {
    return given().count(name) ? declare_or_get_parameter<T>(name) : usual;
  }
  template<typename F> rclcpp::node_interfaces::PostSetParametersCallbackHandle::SharedPtr add_post_set_parameters_callback(F) { return {}; }
  template<typename F> rclcpp::node_interfaces::OnSetParametersCallbackHandle::SharedPtr add_on_set_parameters_callback(F) { return {}; }
  template<typename H> void remove_post_set_parameters_callback(H) {}
  template<typename H> void remove_on_set_parameters_callback(H) {}
};
struct TransformBuffer { using SharedPtr = std::shared_ptr<TransformBuffer>; geometry_msgs::msg::Pose robot; };  // where base_link is
template<typename N> void declare_parameter_if_not_declared(N, const std::string &, rclcpp::ParameterValue) {}
template<typename N> std::string get_plugin_type_param(N, const std::string & ns) {
  auto it = given().find(ns + ".plugin");
  return it == given().end() ? "mppi::DefaultOptimalTrajectoryValidator" : it->second;
}
}

namespace pluginlib {
struct PluginlibException : std::runtime_error { using std::runtime_error::runtime_error; };
template<typename Base> std::map<std::string, std::function<Base *()>> & table() {
  static std::map<std::string, std::function<Base *()>> t; return t;
}
template<typename Base> struct ClassLoader {
  ClassLoader(const std::string &, const std::string &) {}
  Base * createUnmanagedInstance(const std::string & name) {
    auto it = table<Base>().find(name == "mppi::DefaultOptimalTrajectoryValidator" ? "mppi::OptimalTrajectoryValidator" : name);
    if (it == table<Base>().end()) { throw PluginlibException(name); }
    return it->second();
  }
  std::shared_ptr<Base> createSharedInstance(const std::string & n) { return std::shared_ptr<Base>(createUnmanagedInstance(n)); }
  std::shared_ptr<Base> createUniqueInstance(const std::string & n) { return createSharedInstance(n); }
};
}
#define STUB_JOIN2(a, b) a##b
#define STUB_JOIN(a, b) STUB_JOIN2(a, b)
#define PLUGINLIB_EXPORT_CLASS(D, B) \
  static bool STUB_JOIN(registered_, __COUNTER__) = [] { pluginlib::table<B>()[#D] = [] () -> B * { return new D(); }; return true; }();

namespace nav2_costmap_2d {
struct Costmap2D {
  using mutex_t = std::recursive_mutex; mutex_t mutex; mutex_t * getMutex() { return &mutex; }
  double getSizeInMetersX() const { return (nx - 1 + 0.5) * resolution_; }
  std::vector<unsigned char> cells; unsigned nx{0}, ny{0}; double resolution_{0.05}, ox{0}, oy{0};
  double getOriginX() const { return ox; } double getOriginY() const { return oy; } double getResolution() const { return resolution_; }
  unsigned getSizeInCellsX() const { return nx; } unsigned getSizeInCellsY() const { return ny; }
  unsigned char getCost(unsigned i) const { return cells[i]; }
  unsigned char getCost(unsigned x, unsigned y) const { return cells[y * nx + x]; }
  bool worldToMap(double wx, double wy, unsigned & mx, unsigned & my) const {
    if (wx < ox || wy < oy) { return false; }
    mx = static_cast<unsigned>((wx - ox) / resolution_);
    my = static_cast<unsigned>((wy - oy) / resolution_);
    return mx < nx && my < ny;
  }
};
struct LayeredCostmap {
  bool unknown{true}; double circumscribed{0}, inscribed{0};
  bool isTrackingUnknown() const { return unknown; }
  double getCircumscribedRadius() const { return circumscribed; } double getInscribedRadius() const { return inscribed; }
};
struct Costmap2DROS;
struct InflationLayerInterface {
  double scaling, radius, resolution, inscribed;
  static std::shared_ptr<InflationLayerInterface> getInflationLayer(std::shared_ptr<Costmap2DROS> &, std::string = "");
  double getCostScalingFactor() const { return scaling; } double getInflationRadius() const { return radius; }
  unsigned char computeCost(double distance) const {
    if (distance == 0) { return 254; }
    if (distance * resolution <= inscribed) { return 253; }
    return static_cast<unsigned char>(252 * std::exp(-1.0 * scaling * (distance * resolution - inscribed)));
  }
};
struct Costmap2DROS {
  Costmap2D map; LayeredCostmap layered; std::vector<geometry_msgs::msg::Point> footprint; bool use_radius{false};
  std::shared_ptr<InflationLayerInterface> inflation;
  Costmap2D * getCostmap() { return &map; } LayeredCostmap * getLayeredCostmap() { return &layered; }
  std::vector<geometry_msgs::msg::Point> getRobotFootprint() { return footprint; }
  bool getUseRadius() { return use_radius; } std::string getBaseFrameID() { return "base_link"; }
  std::string getGlobalFrameID() { return "odom"; } double getTransformTolerance() { return 0.1; }
};
inline std::shared_ptr<InflationLayerInterface> InflationLayerInterface::getInflationLayer(
  std::shared_ptr<Costmap2DROS> & c, std::string) { return c->inflation; }
}
namespace nav2_util::geometry_utils {
inline geometry_msgs::msg::Quaternion orientationAroundZAxis(double angle) {
  tf2::Quaternion q; q.setRPY(0, 0, angle); return tf2::toMsg(q);
}
inline double calculate_path_length(const nav_msgs::msg::Path & path) {
  double length = 0;
  for (size_t i = 0; i + 1 < path.poses.size(); ++i) {
    const auto & a = path.poses[i].pose.position; const auto & b = path.poses[i + 1].pose.position;
    length += std::hypot(a.x - b.x, a.y - b.y);
  }
  return length;
}
}
namespace nav2_util {
inline bool transformPathInTargetFrame(
  const nav_msgs::msg::Path & path, nav_msgs::msg::Path & told, nav2::TransformBuffer & tf, const std::string &, double)
{
  const auto & at = tf.robot; const double yaw = tf2::getYaw(at.orientation), c = std::cos(yaw), s = std::sin(yaw);
  told = path;
  for (auto & p : told.poses) {
    const double dx = p.pose.position.x - at.position.x, dy = p.pose.position.y - at.position.y;
    p.pose.position.x = c * dx + s * dy; p.pose.position.y = c * dy - s * dx;
    p.pose.orientation = geometry_utils::orientationAroundZAxis(tf2::getYaw(p.pose.orientation) - yaw);
  }
  return true;
}
}
#endif
