// The grammar of JSON (RFC 8259) as a pull: who derives from it takes each value where it stands, or
// skips it. Bounds depth, number of values and the memory that a parser would need.
#ifndef TWEEND_GLTF_JSON_SCAN_HPP
#define TWEEND_GLTF_JSON_SCAN_HPP

#include <cstdint>
#include <cstring>
#include <string_view>

#include "gltf/refusal.hpp"

namespace gltf {

class JsonScan {
protected:
  static constexpr int depth_max = 64;
  // What the parsed document may cost in memory: much more than any exporter's text needs, much less
  // than text made to be dear.
  static constexpr uint64_t cost_free = 32u << 20, cost_per_byte = 64, cost_max = uint64_t{1} << 30;
  static constexpr uint64_t value_cost = 256; // a node of the JSON tree and its copy

  // values_max 0: no limit.
  JsonScan(const char *text, size_t size, uint64_t values_max)
      : start_(text), at_(text), end_(text + size), size_(size), values_max_(values_max) {
    // A byte order mark is passed over by the parser too.
    if (size >= 3 && std::memcmp(text, "\xEF\xBB\xBF", 3) == 0) at_ += 3;
  }

  [[noreturn]] void malformed(const char *what) {
    refuse(TW_SYNTAX, "", what, ", at byte ", at_ - start_, " of the JSON text");
  }

  void blanks() {
    while (at_ < end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) at_++;
  }

  char peek() {
    blanks();
    if (at_ == end_) malformed("the JSON text ends too early");
    return *at_;
  }

  void expect(char c) {
    if (peek() != c) malformed("the JSON text is malformed");
    at_++;
  }

  void spend(uint64_t cost) {
    cost_ += cost;
    if (cost_ > cost_max || cost_ > cost_free + cost_per_byte * size_)
      refuse(TW_LIMIT, "", "the JSON text would take too much memory to parse");
  }

  void count_value() {
    values_++;
    if (values_max_ != 0 && values_ > values_max_)
      refuse(TW_LIMIT, "", "the JSON text has more than ", values_max_, " values");
    spend(value_cost);
  }

  void open(char c) {
    if (++depth_ > depth_max) refuse(TW_SYNTAX, "", "the JSON text is nested more than ", depth_max, " deep");
    count_value();
    expect(c);
  }

  // After an element: whether another one follows.
  bool more(char closing) {
    char c = peek();
    if (c != ',' && c != closing) malformed("the JSON text is malformed");
    at_++;
    return c == ',';
  }

  // The text between the quotes, as it is written.
  std::string_view string() {
    expect('"');
    const char *start = at_;
    while (at_ < end_ && *at_ != '"') {
      if (static_cast<unsigned char>(*at_) < 0x20) malformed("a string has a control character");
      if (*at_ == '\\' && ++at_ == end_) break;
      at_++;
    }
    if (at_ == end_) malformed("a string does not end");
    return {start, static_cast<size_t>(at_++ - start)};
  }

  void word(const char *expected) {
    size_t length = std::strlen(expected);
    if (static_cast<size_t>(end_ - at_) < length || std::memcmp(at_, expected, length) != 0)
      malformed("the JSON text is malformed");
    at_ += length;
  }

  void number() {
    const char *start = at_;
    while (at_ < end_ && std::strchr("+-.eE0123456789", *at_) && *at_) at_++;
    if (at_ == start) malformed("the JSON text is malformed"); // its grammar is the parser's to check
  }

  // Calls member(key) behind the colon of each member; it must take the value.
  template <typename Member> void object(Member member) {
    open('{');
    if (peek() == '}') {
      at_++;
    } else {
      do {
        peek();
        std::string_view key = string();
        spend(key.size());
        expect(':');
        member(key);
      } while (more('}'));
    }
    depth_--;
  }

  template <typename Element> uint64_t array(Element element) {
    uint64_t count = 0;
    open('[');
    if (peek() == ']') {
      at_++;
    } else {
      do {
        element(count++);
      } while (more(']'));
    }
    depth_--;
    return count;
  }

  void skip() {
    switch (peek()) {
    case '{': object([this](std::string_view) { skip(); }); return;
    case '[': array([this](uint64_t) { skip(); }); return;
    default: break;
    }
    count_value();
    switch (*at_) {
    case '"': string(); break;
    case 't': word("true"); break;
    case 'f': word("false"); break;
    case 'n': word("null"); break;
    default: number(); break;
    }
  }

  const char *start_, *at_, *end_;
  size_t size_;
  uint64_t values_max_;
  int depth_ = 0;
  uint64_t values_ = 0, cost_ = 0;
};

} // namespace gltf

#endif
