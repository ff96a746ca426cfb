#include "traceur/render/whole_file.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <set>
#include <string>

namespace traceur::render {
namespace {

/// A file read from the front, and how much of it is left.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : in_(file, std::ios::binary) {
    std::error_code error;
    left_ = std::filesystem::file_size(file, error);
    if (error) left_ = 0;
  }
  std::uint64_t left() const { return left_; }
  /// @return fewer at the end
  std::string take(std::uint64_t n) {
    std::string bytes(std::min(n, left_), '\0');
    in_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(in_.gcount());
    left_ -= bytes.size();
    return bytes;
  }
  /// An unsigned number, the highest byte first; 0 at the end.
  std::uint64_t number(int bytes) {
    std::uint64_t value = 0;
    for (const char c : take(bytes)) value = value << 8 | static_cast<unsigned char>(c);
    return value;
  }
  /// @return whether there was so much
  bool skip(std::uint64_t n) {
    if (n > left_) return false;
    in_.seekg(static_cast<std::streamoff>(n), std::ios::cur);
    left_ -= n;
    return true;
  }

 private:
  std::ifstream in_;
  std::uint64_t left_ = 0;
};

}  // namespace

bool isWholePng(const std::filesystem::path& file) {
  Reader in(file);
  if (in.take(8) != "\x89PNG\r\n\x1a\n") return false;
  std::string type;
  while (in.left() > 0) {
    const std::uint64_t length = in.number(4);
    type = in.take(4);
    static constexpr int kChecksum = 4;
    if (!in.skip(length + kChecksum)) return false;
  }
  return type == "IEND";
}

bool isWholeSvg(const std::filesystem::path& file) {
  Reader in(file);
  static constexpr std::uint64_t kEnough = 64;
  in.skip(in.left() - std::min(in.left(), kEnough));
  std::string end = in.take(kEnough);
  while (!end.empty() && (end.back() == '\n' || end.back() == ' ')) end.pop_back();
  return end.ends_with("</svg>");
}

bool isWholeMp4(const std::filesystem::path& file) {
  Reader in(file);
  std::set<std::string> types;
  while (in.left() > 0) {
    std::uint64_t header = 8;
    std::uint64_t length = in.number(4);
    types.insert(in.take(4));
    if (length == 1) {  // the length does not fit
      header = 16;
      length = in.number(8);
    }
    if (length < header || !in.skip(length - header)) return false;
  }
  return types.contains("ftyp") && types.contains("moov") && types.contains("mdat");
}

}  // namespace traceur::render
