// A robot's MJCF or URDF, made one text for the engine to read.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace traceur::sim {

/// What a robot's file says, with what it includes put in; a URDF's base floats, its meshes have
/// absolute paths. Each element knows its place in the person's files.
class ModelFile {
 public:
  /// @throws InputError with file and line
  explicit ModelFile(const std::filesystem::path& file);

  const std::string& text() const { return text_; }
  const std::filesystem::path& file() const { return file_; }
  /// Reports what the engine said of text(): its line becomes the person's.
  /// @throws InputError "FILE:LINE: …"
  [[noreturn]] void fail(const std::string& engines_words) const;

 private:
  struct Place {
    std::filesystem::path file;
    int line = 0;
  };

  void include(tinyxml2::XMLElement* parent, const std::filesystem::path& file,
               std::set<std::filesystem::path>& included);
  void note(const tinyxml2::XMLElement* element, const tinyxml2::XMLElement* origin,
            const std::filesystem::path& file);
  void makeUrdfReady();
  Place placeOf(int line_of_text) const;

  std::filesystem::path file_;
  tinyxml2::XMLDocument document_;
  std::map<const tinyxml2::XMLElement*, Place> places_;
  std::string text_;
};

}  // namespace traceur::sim
