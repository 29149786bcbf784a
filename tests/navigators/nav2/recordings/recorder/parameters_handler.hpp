#pragma once
#include "ros.hpp"
namespace mppi {
enum class ParameterType { Dynamic, Static };
inline void parse(const std::string & s, bool & v) { v = s == "true"; }
inline void parse(const std::string & s, int & v) { v = std::stoi(s); }
inline void parse(const std::string & s, double & v) { v = std::stod(s); }
inline void parse(const std::string & s, float & v) { v = static_cast<float>(std::stod(s)); }
inline void parse(const std::string & s, std::string & v) { v = s; }
inline void parse(const std::string & s, std::vector<std::string> & v) { v.clear(); std::istringstream i(s); std::string w; while (i >> w) { v.push_back(w); } }
inline void parse(const std::string & s, std::vector<double> & v) { v.clear(); std::istringstream i(s); double w; while (i >> w) { v.push_back(w); } }
inline std::string shown(bool v) { return v ? "true" : "false"; }
inline std::string shown(int v) { return std::to_string(v); }
inline std::string shown(double v) { char b[64]; snprintf(b, 64, "%.17g", v); return b; }
inline std::string shown(const std::string & v) { return v; }
template<typename T> std::string shown(const std::vector<T> & v) { std::ostringstream o; for (auto & w : v) { o << w << " "; } return o.str(); }
struct ParametersHandler {
  auto getParamGetter(const std::string & ns) {
    return [ns](auto & setting, const std::string & name, auto value, ParameterType = ParameterType::Dynamic) {
      const std::string full = ns.empty() ? name : ns + "." + name;
      if (!given().count(full)) { given()[full] = shown(value); }  // declared with this default
      decltype(value) read{};
      parse(given()[full], read);
      setting = static_cast<std::decay_t<decltype(setting)>>(read);
    };
  }
  template<typename T> void addPostCallback(T &&) {}
  template<typename T> void addPreCallback(const std::string &, T &&) {}
  template<typename T> void addParamCallback(const std::string &, T &&) {}
};
}
