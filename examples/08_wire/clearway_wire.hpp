// Clearway's wire in one header of C++17, without any library: MessagePack, its length before it, on the standard streams.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace clearway {

struct Value {  // of a message: a number (true is 1), a text or an array's bytes, a list, a map, or nothing
  double number = 0.0;
  bool null = false;
  std::string bytes;
  std::vector<Value> list;
  std::map<std::string, Value> map;
  const Value& operator[](const std::string& key) const { return map.at(key); }
  double operator[](std::size_t i) const { return list.at(i).number; }
  std::vector<double> array() const {  // of float64, on a machine that is little-endian
    std::vector<double> found(bytes.size() / 8);
    std::memcpy(found.data(), bytes.data(), 8 * found.size());
    return found;
  }
};

inline uint64_t whole(const std::string& b, std::size_t& at, unsigned n) {
  uint64_t x = 0;
  while (n--) x = x << 8 | uint8_t(b.at(at++));
  return x;
}

inline Value read(const std::string& b, std::size_t& at) {  // the value in MessagePack that begins at `at`
  const unsigned tag = unsigned(whole(b, at, 1));
  Value v;
  auto text = [&](std::size_t n) { v.bytes = b.substr(at, n); at += n; };
  auto list = [&](std::size_t n) { while (n--) v.list.push_back(read(b, at)); };
  auto map = [&](std::size_t n) { while (n--) { const std::string key = read(b, at).bytes; v.map[key] = read(b, at); } };
  if (tag < 0x80) v.number = tag;
  else if (tag < 0x90) map(tag & 15);
  else if (tag < 0xa0) list(tag & 15);
  else if (tag < 0xc0) text(tag & 31);
  else if (tag == 0xc0) v.null = true;
  else if (tag == 0xc2 || tag == 0xc3) v.number = tag & 1;
  else if (tag >= 0xc4 && tag <= 0xc6) text(whole(b, at, 1u << (tag - 0xc4)));
  else if (tag == 0xcb) { const uint64_t bits = whole(b, at, 8); std::memcpy(&v.number, &bits, 8); }
  else if (tag >= 0xcc && tag <= 0xcf) v.number = double(whole(b, at, 1u << (tag - 0xcc)));
  else if (tag >= 0xd0 && tag <= 0xd3) { const unsigned n = 1u << (tag - 0xd0); v.number = double(int64_t(whole(b, at, n) << (64 - 8 * n)) >> (64 - 8 * n)); }
  else if (tag >= 0xd9 && tag <= 0xdb) text(whole(b, at, 1u << (tag - 0xd9)));
  else if (tag == 0xdc || tag == 0xdd) list(whole(b, at, tag == 0xdc ? 2 : 4));
  else if (tag == 0xde || tag == 0xdf) map(whole(b, at, tag == 0xde ? 2 : 4));
  else if (tag >= 0xe0) v.number = int(tag) - 256;
  else throw std::runtime_error("MessagePack that no message of Clearway has");
  return v;
}

inline bool receive(Value& message) {  // false: Clearway has closed the line
  std::string b(4, '\0');
  std::size_t at = 0;
  if (std::fread(&b[0], 1, 4, stdin) < 4) return false;
  b.resize(whole(b, at, 4));
  if (std::fread(&b[0], 1, b.size(), stdin) < b.size()) return false;
  return message = read(b, at = 0), true;
}

inline std::string big_endian(uint64_t x, int n) { std::string s; while (n--) s += char(x >> 8 * n); return s; }
inline std::string pack(double x) { uint64_t bits; std::memcpy(&bits, &x, 8); return '\xcb' + big_endian(bits, 8); }
inline std::string pack(const std::string& s) { return (s.size() < 32 ? std::string(1, char(0xa0 | s.size())) : '\xda' + big_endian(s.size(), 2)) + s; }
inline std::string pack(const char* s) { return pack(std::string(s)); } inline std::string pack(bool b) { return b ? "\xc3" : "\xc2"; }
inline std::string pack(const std::vector<std::string>& l) { std::string s(1, char(0x90 | l.size())); for (auto& x : l) s += pack(x); return s; }

inline void send(const std::string& type, const std::map<std::string, std::string>& packed) {
  std::string b = char(0x81 + packed.size()) + pack("type") + pack(type);
  for (auto& [key, value] : packed) b += pack(key) + value;
  b = big_endian(b.size(), 4) + b;
  std::fwrite(b.data(), 1, b.size(), stdout), std::fflush(stdout);
}
}  // namespace clearway
