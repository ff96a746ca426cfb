#include "traceur/sim/model_file.h"

#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <optional>
#include <regex>
#include <vector>

#include "traceur/core/error.h"
#include "traceur/core/is_file.h"
#include "traceur/core/toml.h"

namespace traceur::sim {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;
namespace fs = std::filesystem;

[[noreturn]] void failAt(const fs::path& file, int line, const std::string& what) {
  throw InputError(line > 0 ? fmt::format("{}:{}: {}", file.string(), line, what)
                            : fmt::format("{}: {}", file.string(), what));
}

void parse(XMLDocument& document, const fs::path& file) {
  const std::string text = readFile(file);
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    failAt(file, document.ErrorLineNum(),
           fmt::format("not well-formed XML ({})", document.ErrorName()));
  }
  if (!document.RootElement()) failAt(file, 0, "expected an element, got none");
}

/// This element and all below it, in an order that depends on their tree alone.
template <class Element>
std::vector<Element*> all(Element* top) {
  std::vector<Element*> found = {top};
  for (size_t i = 0; i < found.size(); ++i) {
    for (auto* c = found[i]->FirstChildElement(); c; c = c->NextSiblingElement()) {
      found.push_back(c);
    }
  }
  return found;
}

XMLElement* childOrNew(XMLElement* parent, const char* name) {
  XMLElement* child = parent->FirstChildElement(name);
  return child ? child : parent->InsertNewChildElement(name);
}

bool is(const XMLElement* e, const char* name) {
  return std::strcmp(e->Name(), name) == 0;
}

/// "my%20mesh.stl" as the name it means; a Windows path with its backslashes turned.
std::string plainPath(std::string_view name) {
  std::string plain;
  for (size_t i = 0; i < name.size(); ++i) {
    unsigned code = 0;
    if (name[i] == '%' && i + 2 < name.size() && std::isxdigit(name[i + 1]) &&
        std::isxdigit(name[i + 2])) {
      code = static_cast<unsigned>(std::stoul(std::string(name.substr(i + 1, 2)), nullptr, 16));
    }
    if (code > 0) {
      plain += static_cast<char>(code);
      i += 2;
    } else {
      plain += name[i] == '\\' ? '/' : name[i];
    }
  }
  return plain;
}

/// The package's name and the path in it: package://NAME/PATH, model://NAME/PATH, $(find
/// NAME)/PATH.
std::optional<std::pair<std::string, std::string>> inPackage(const std::string& name) {
  static constexpr size_t kLongest = 4096;  // no path is longer, and the expression is recursive
  if (name.size() > kLongest) return {};
  static const std::regex kForm(R"((?:(?:package|model)://([^/]+)|\$\(find ([^)]+)\))/+(.+))");
  std::smatch match;
  if (!std::regex_match(name, match, kForm)) return {};
  return std::pair(match[1].str() + match[2].str(), match[3].str());
}

std::vector<fs::path> listed(const char* variable, const char* below = "") {
  std::vector<fs::path> folders;
  const char* value = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nobody sets it
  for (std::string_view rest = value ? value : ""; !rest.empty();) {
    const size_t end = std::min(rest.find(':'), rest.size());
    if (end > 0) folders.push_back(fs::path(rest.substr(0, end)) / below);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return folders;
}

/// Whether a folder's package.xml says that it is this package, whatever the folder is called.
bool isPackage(const fs::path& folder, const std::string& name) {
  XMLDocument package;
  if (!isFile(folder / "package.xml") ||
      package.LoadFile((folder / "package.xml").c_str()) != tinyxml2::XML_SUCCESS) {
    return false;
  }
  const XMLElement* root = package.RootElement();
  const XMLElement* said = root ? root->FirstChildElement("name") : nullptr;
  return said && said->GetText() && name == said->GetText();
}

/// Where ROS would look, then the URDF's folder and those above it: as a package, or with it.
std::optional<fs::path> packageFile(const std::string& package, const std::string& inside,
                                    const fs::path& urdf) {
  std::vector<fs::path> above = listed("ROS_PACKAGE_PATH");
  for (const fs::path& p : listed("AMENT_PREFIX_PATH", "share")) above.push_back(p);
  for (fs::path dir = urdf.parent_path();; dir = dir.parent_path()) {
    if (isPackage(dir, package) && isFile(dir / inside)) return dir / inside;
    above.push_back(dir);
    if (!dir.has_relative_path()) break;
  }
  for (const fs::path& folder : above) {
    if (isFile(folder / package / inside)) return folder / package / inside;
  }
  return {};
}

std::optional<fs::path> meshFile(const std::string& said, const fs::path& urdf,
                                 const std::string& mesh_dir) {
  std::string name = plainPath(said);
  if (const auto parts = inPackage(name)) return packageFile(parts->first, parts->second, urdf);
  if (name.starts_with("file://")) name.erase(0, 7);
  const fs::path dir = urdf.parent_path();
  // The engine alone strips paths and looks in the folder that the file's <compiler> says.
  for (const fs::path& path :
       {dir / name, dir / mesh_dir / name, dir / mesh_dir / fs::path(name).filename()}) {
    if (isFile(path)) return path;
  }
  return {};
}

/// Whether the engine reads such a mesh: .obj, .msh and binary .stl.
bool isReadable(const fs::path& mesh) {
  std::string kind = mesh.extension().string();
  for (char& c : kind) c = static_cast<char>(std::tolower(c));
  return kind == ".obj" || kind == ".msh" || kind == ".stl";
}

}  // namespace

ModelFile::ModelFile(const fs::path& file) : file_(fs::absolute(file).lexically_normal()) {
  parse(document_, file_);
  XMLElement* root = document_.RootElement();
  note(root, root, file_);
  if (is(root, "robot")) {
    makeUrdfReady();
  } else if (is(root, "mujoco")) {
    std::set<fs::path> included = {file_};
    include(root, file_, included);
  } else {
    failAt(file_, root->GetLineNum(),
           fmt::format("expected <mujoco> (MJCF) or <robot> (URDF), got <{}>", root->Name()));
  }
  tinyxml2::XMLPrinter printer;
  document_.Print(&printer);
  text_ = printer.CStr();
}

/// Notes the places of an element and of all below it; `origin` is the same in its own document.
void ModelFile::note(const XMLElement* element, const XMLElement* origin, const fs::path& file) {
  const auto here = all(element);
  const auto there = all(origin);
  for (size_t i = 0; i < here.size(); ++i) places_[here[i]] = {file, there[i]->GetLineNum()};
}

/// Puts the children of every <include file="…"/> in its place. As for the engine, each file is
/// included once, and its name is of a file beside the first one, else beside the one that says it.
void ModelFile::include(XMLElement* parent, const fs::path& file, std::set<fs::path>& included) {
  for (XMLElement* e = parent->FirstChildElement(); e;) {
    XMLElement* next = e->NextSiblingElement();
    if (!is(e, "include")) {
      // The parser itself opens these, from wherever it runs.
      const char* opened = is(e, "model") || is(e, "flexcomp") ? e->Attribute("file") : nullptr;
      if (opened) e->SetAttribute("file", (file_.parent_path() / opened).c_str());
      include(e, file, included);
      e = next;
      continue;
    }
    const char* name = e->Attribute("file");
    if (!name) failAt(places_.at(e).file, places_.at(e).line, "<include> without a file");
    fs::path path = (file_.parent_path() / name).lexically_normal();
    if (!isFile(path)) path = (places_.at(e).file.parent_path() / name).lexically_normal();
    if (!included.insert(path).second) {
      failAt(places_.at(e).file, places_.at(e).line,
             fmt::format("{} is included twice", path.string()));
    }
    XMLDocument other;
    parse(other, path);
    tinyxml2::XMLNode* after = e;
    std::vector<XMLElement*> added;
    for (auto* c = other.RootElement()->FirstChild(); c; c = c->NextSibling()) {
      after = parent->InsertAfterChild(after, c->DeepClone(&document_));
      if (!c->ToElement()) continue;
      note(after->ToElement(), c->ToElement(), path);
      added.push_back(after->ToElement());
    }
    for (const XMLElement* gone : all(static_cast<const XMLElement*>(e))) places_.erase(gone);
    parent->DeleteChild(e);
    e = added.empty() ? next : added.front();  // what was put in may include more
  }
}

/// The base floats in the engine where a link named "world" carries it by a floating joint. Meshes
/// are looked for as ROS does; one that is only seen and cannot be read is left out, as the engine
/// alone leaves out all that is only seen.
void ModelFile::makeUrdfReady() {
  XMLElement* robot = document_.RootElement();
  std::set<std::string> children;
  std::set<std::string> joints;
  for (auto* j = robot->FirstChildElement("joint"); j; j = j->NextSiblingElement("joint")) {
    const XMLElement* child = j->FirstChildElement("child");
    if (child && child->Attribute("link")) children.insert(child->Attribute("link"));
    if (j->Attribute("name")) joints.insert(j->Attribute("name"));
  }
  std::string base;
  for (auto* l = robot->FirstChildElement("link"); l; l = l->NextSiblingElement("link")) {
    const char* name = l->Attribute("name");
    if (name && !children.contains(name) && base.empty()) base = name;
  }
  if (base.empty()) {
    failAt(file_, robot->GetLineNum(), "no link without a parent: where does the robot begin?");
  }
  if (base != "world") {
    std::string root = "root";
    while (joints.contains(root)) root += '_';
    robot->InsertNewChildElement("link")->SetAttribute("name", "world");
    XMLElement* joint = robot->InsertNewChildElement("joint");
    joint->SetAttribute("name", root.c_str());
    joint->SetAttribute("type", "floating");
    joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
    joint->InsertNewChildElement("child")->SetAttribute("link", base.c_str());
  }
  XMLElement* compiler = childOrNew(childOrNew(robot, "mujoco"), "compiler");
  const char* mesh_dir = compiler->Attribute("meshdir");
  for (XMLElement* link = robot->FirstChildElement("link"); link;
       link = link->NextSiblingElement("link")) {
    for (XMLElement* shape = link->FirstChildElement(); shape;) {
      XMLElement* next = shape->NextSiblingElement();
      XMLElement* geometry = shape->FirstChildElement("geometry");
      XMLElement* mesh = geometry ? geometry->FirstChildElement("mesh") : nullptr;
      if (const char* said = mesh ? mesh->Attribute("filename") : nullptr) {
        const auto path = meshFile(said, file_, mesh_dir ? mesh_dir : "");
        if (path && isReadable(*path)) {
          mesh->SetAttribute("filename", path->lexically_normal().c_str());
        } else if (is(shape, "visual")) {
          for (const XMLElement* e : all(static_cast<const XMLElement*>(shape))) places_.erase(e);
          link->DeleteChild(shape);
        } else if (path) {
          failAt(file_, mesh->GetLineNum(),
                 fmt::format("{}: expected a mesh of .stl (binary), .obj or .msh, which the engine "
                             "reads: convert it",
                             said));
        } else {
          failAt(file_, mesh->GetLineNum(), fmt::format("no such mesh: {}", said));
        }
      }
      shape = next;
    }
  }
  compiler->DeleteAttribute("meshdir");
  compiler->SetAttribute("strippath", "false");
  compiler->SetAttribute("fusestatic", "false");
  compiler->SetAttribute("discardvisual", "false");
}

/// Where the element of text() that begins on this line, or as the last before it, comes from.
ModelFile::Place ModelFile::placeOf(int line_of_text) const {
  XMLDocument printed;
  printed.Parse(text_.data(), text_.size());
  const auto there = all(static_cast<const XMLElement*>(printed.RootElement()));
  const auto here = all(static_cast<const XMLElement*>(document_.RootElement()));
  Place place{file_, 0};
  int best = 0;
  for (size_t i = 0; i < there.size(); ++i) {
    const int line = there[i]->GetLineNum();
    const auto known = places_.find(here[i]);
    if (line > line_of_text || line < best || known == places_.end()) continue;
    best = line;
    place = known->second;
  }
  return place;
}

void ModelFile::fail(const std::string& engines_words) const {
  static const std::regex kLine(R"(,? ?line (\d+))");
  std::smatch match;
  std::string words = engines_words;
  Place place{file_, 0};
  if (std::regex_search(words, match, kLine)) {
    if (const int line = std::atoi(match[1].str().c_str()); line > 0) place = placeOf(line);
    words = match.prefix().str() + match.suffix().str();
  }
  words = std::regex_replace(words, std::regex(R"(^(XML )?Error: )"), "");
  words = std::regex_replace(words, std::regex(R"(\s*\n\s*)"), "; ");
  words = std::regex_replace(words, std::regex(R"([;\s]+$)"), "");
  failAt(place.file, place.line, words);
}

}  // namespace traceur::sim
