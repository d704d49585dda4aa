// The archive that documents.

#include "apps/scene/key_tables.hpp"

#include "apps/base/toml_writer.hpp"
#include "apps/scene/keys.hpp"
#include "apps/scene/scene_checks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using toml_writer::toml;

// Defaults.
std::string brief(const Key&, const Vector3d& v) {
  return v.isZero(0) ? "zero" : fmt::format("[{:g}, {:g}, {:g}]", v.x(), v.y(), v.z());
}
std::string brief(const Key&, const Vector4d& v) {
  return fmt::format("[{:g}, {:g}, {:g}, {:g}]", v[0], v[1], v[2], v[3]);
}
std::string brief(const Key&, const Matrix3d&) { return "zero"; }
std::string brief(const Key&, double v) { return fmt::format("{:g}", v); }
std::string brief(const Key&, int v) { return fmt::format("{}", v); }
std::string brief(const Key&, bool v) { return v ? "true" : "false"; }
std::string brief(const Key&, const std::string& v) { return v.empty() ? "none" : '`' + toml(v) + '`'; }
std::string brief(const Key& k, const Choice& v) { return '`' + toml(k.words[v.index]) + '`'; }
std::string brief(const Key& k, const NumberOrWord& v) {
  return v.word.empty() ? brief(k, v.number) : brief(k, v.word);
}
template <class T>
std::string brief(const Key&, const T&) {
  return "none";
}

class KeyDocument : public Archive {
 public:
  /// The section of that title is the last, or there already and then passed over.
  KeyDocument(std::vector<KeySection>& sections, std::string path, std::string title, std::string_view what)
      : sections_(sections), path_(std::move(path)) {
    is_new_ = std::ranges::find(sections, title, &KeySection::title) == sections.end();
    section_ = sections.size();
    if (is_new_) sections.push_back({std::move(title), std::string(what), {}});
  }
  Use use() const override { return Use::document; }
  bool is_new() const { return is_new_; }

  void part(std::string_view name, const std::function<void(Archive&)>& keys) override {
    KeyDocument below(sections_, path_, std::string(name), "");
    if (below.is_new()) keys(below);
  }

 protected:
  void item(const Key& key, const AnyKeyValue& any) override {
    add(key, std::visit([&](const auto& i) { return brief(key, *i.value); }, any),
        std::holds_alternative<KeyValue<NumberOrWord>>(any) ? ", or " : ": ");
  }

  void below(const Key& key, const Tables& tables) override {
    const std::string path = scene_checks::join(path_, key.name);
    if (!tables.name.empty()) add(key, "none", "");
    const std::string title = !tables.name.empty() ? std::string(tables.name)
                              : tables.many        ? "[[" + path + "]]"
                                                   : "[" + path + "]";
    KeyDocument below(sections_, path, title, tables.name.empty() ? key.what : "");
    if (below.is_new()) tables.keys(below, tables.count);
    if (below.is_new() && sections_[below.section_].rows.empty())
      sections_.erase(sections_.begin() + static_cast<std::ptrdiff_t>(below.section_));
  }

 private:
  void add(const Key& key, const std::string& value, const char* before_words) {
    std::string what(key.what);
    std::vector<std::string> words;
    for (const std::string_view word : key.words) words.push_back('`' + toml(word) + '`');
    if (!words.empty()) what += before_words + fmt::format("{}", fmt::join(words, ", "));
    const std::string otherwise = key.required ? "" : key.otherwise.empty() ? value : std::string(key.otherwise);
    sections_[section_].rows.push_back({std::string(key.name), std::string(key.unit), what, otherwise});
  }

  std::vector<KeySection>& sections_;
  std::string path_;
  size_t section_ = 0;
  bool is_new_ = false;
};

template <class T>
void document(std::vector<KeySection>& sections, const char* path, const char* title, const char* what, Keys<T> keys,
              T value = {}) {
  KeyDocument archive(sections, path, title, what);
  keys(archive, value);
}

}  // namespace

std::vector<KeySection> key_sections() {
  std::vector<KeySection> all;
  document<Scene>(all, "", "Top level of a scene", "", scene_keys_of_file);
  BodyScene rigid, reduced;
  rigid.rigid.emplace(), reduced.reduced_file = "body.h5";
  document<BodyScene>(all, "", "Rigid `[[bodies]]`", "A body with `mass` is rigid.", body_keys, rigid);
  document<BodyScene>(all, "", "Reduced `[[bodies]]`", "A body whose `file` is an `.h5` file is read from it.",
                      body_keys, reduced);
  document<TimeTable>(all, "", "Table over time", "A function of time.", time_table_keys);
  document<Manoeuvre>(all, "", "Turn over time", "A function of time: a turn from rest to rest.", timed_turn_keys);
  return all;
}

std::string to_markdown(const KeySection& section) {
  std::string text =
      fmt::format("### {}\n", section.title.starts_with('[') ? '`' + section.title + '`' : section.title);
  if (!section.what.empty()) text += section.what + "\n\n";
  text += "| key | unit | default | what it is |\n|---|---|---|---|\n";
  for (const KeyRow& row : section.rows)
    text += fmt::format("| `{}` | {} | {} | {} |\n", row.key, row.unit, row.otherwise, row.what);
  return text;
}

}  // namespace flexboom
