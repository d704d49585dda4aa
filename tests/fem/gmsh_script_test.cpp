#include "fem/formats/gmsh/script.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "mesh_file_testing.hpp"

#include <map>

namespace flexboom::testing {
namespace {

// What is said of the first of some files, "" if nothing.
std::string said(const std::string& first, const std::map<std::string, std::string>& files) {
  const Folder folder;
  for (const auto& [name, text] : files) write_file(folder.path / name, text);
  std::string message;
  try {
    refuse_commands(folder.path / first);
  } catch (const InputError& error) {
    message = error.what();
  }
  const std::string prefix = folder.path.string() + "/";
  for (size_t at = 0; (at = message.find(prefix, at)) != std::string::npos;) message.erase(at, prefix.size());
  return message;
}

const std::string box_script = "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 1, 1, 1};\n";

TEST(GmshScript, CommandsAreRefusedWhereverAndHoweverTheyStand) {
  for (const std::string command : {"SystemCall \"touch x\";",
                                    "NonBlockingSystemCall \"touch x\";",
                                    "System \"touch x\";",
                                    "systemcall 'touch x';",
                                    "SYSTEMCALL\"touch x\";",
                                    "  SystemCall\n\n  \"touch x\" ;",
                                    "SystemCall /* \" */ \"touch x\";",
                                    "If (1) SystemCall StrCat(\"tou\", \"ch x\"); EndIf",
                                    "x = 1; Macro m SystemCall \"touch x\"; Return Call m;",
                                    "1SystemCall \"touch x\";",
                                    "OnelabRun(\"a\", \"touch x\");",
                                    "Field[1] = ExternalProcess;",
                                    "Field[1].CommandLine = \"touch x\";",
                                    "Save \"x.msh\";",
                                    "Save View[0] \"x.pos\";",
                                    "Print \"x.png\";",
                                    "Printf(\"a\") > \"x\";",
                                    "Printf(\"a\") >> name;",
                                    "Printf(\"a %g;\", 1) > \"x\";",
                                    "CreateDir \"x\";",
                                    "Merge \"run.py\";",
                                    "Include \"run.m\";",
                                    "Merge \"part.step.gz\";",
                                    "Merge Sprintf(\"a%g.geo\", 1);",
                                    "Include name;",
                                    "ShapeFromFile(name);",
                                    "Merge \"a\" name;"}) {
    const std::string message = said("a.geo", {{"a.geo", box_script + command}});
    EXPECT_EQ(message.rfind("a.geo:", 0), 0U) << command << ": " << message;
    EXPECT_NE(message.find("--trust"), std::string::npos) << command << ": " << message;
  }
  EXPECT_EQ(said("a.geo", {{"a.geo", box_script + "SystemCall \"touch x\";"}}),
            "a.geo:3:1: \"SystemCall\" starts a program; add --trust if you know what this file does");
}

TEST(GmshScript, FilesThatAreBroughtInAreSeen) {
  const std::string bad = "SystemCall \"touch x\";";
  EXPECT_EQ(said("a.geo", {{"a.geo", "Include \"b.txt\";"}, {"b.txt", bad}}).rfind("b.txt:1:1", 0), 0U);
  EXPECT_EQ(said("a.geo", {{"a.geo", "Merge 'b.geo';"}, {"b.geo", "Include \"c\";"}, {"c", bad}}).rfind("c:1:1", 0),
            0U);
  EXPECT_EQ(said("a.geo", {{"a.geo", "Merge \"b.Step\";"}, {"b.Step", bad}}).rfind("b.Step:1:1", 0),
            0U);  // no data to gmsh
  EXPECT_EQ(said("a.geo", {{"a.geo", "Include \"b.step\";"}, {"b.step", bad}}).rfind("b.step:1:1", 0), 0U);
  EXPECT_EQ(said("a.geo", {{"a.geo", "Merge \"b.msh\";"}, {"b.msh", bad}}).rfind("b.msh:1:1", 0), 0U);
  EXPECT_EQ(said("a.Step", {{"a.Step", bad}}).rfind("a.Step:1:1", 0), 0U);
  EXPECT_EQ(said("a.step", {{"a.step", "data"}, {"a.step.opt", bad}}).rfind("a.step.opt:1:1", 0), 0U);
  const std::string deep = said("a.geo", {{"a.geo", "Include \"a.geo\";" + bad}});  // includes itself
  EXPECT_EQ(deep.rfind("a.geo:1:", 0), 0U) << deep;
}

TEST(GmshScript, WhatGmshWouldReadOtherwiseIsRefused) {
  EXPECT_NE(said("a.geo", {{"a.geo", "x = \"" + std::string(2000, 'a') + "; SystemCall 'b' ;\";"}}), "");
  EXPECT_NE(said("a.geo", {{"a.geo", "x = \"open"}}), "");
  EXPECT_NE(said("a.geo", {{"a.geo", "/* open"}}), "");
  EXPECT_NE(said("a.geo", {{"a.geo", std::string("a\0b", 3)}}), "");
}

TEST(GmshScript, PlainGeometryPasses) {
  const std::string text =
      box_script +
      "// SystemCall \"x\"; Save \"x\";\n/* Print \"x\"; */\nMesh.SaveAll = 1; Print.Width = 3;\n"
      "Save = 3; Printf(\"Save > SystemCall\"); DefineConstant[ n = {3, Name \"Parameters/n\"} ];\n"
      "Merge \"part.step\"; Merge \"old.msh\"; Include \"more.geo\"; Merge \"nowhere.geo\";\n"
      "Physical Volume(\"System\") = {1}; s() = ShapeFromFile(\"part.step\"); If (2 > 1) x = 1; EndIf\n";
  EXPECT_EQ(said("a.geo", {{"a.geo", text},
                           {"part.step", "SystemCall \"data\";"},
                           {"old.msh", "$MeshFormat\n"},
                           {"more.geo", "Mesh.MeshSizeMax = 0.1;"}}),
            "");
}

TEST(GmshScript, TrustGoesToGmsh) {
  const Folder folder;
  write_file(folder.path / "a.geo", "SystemCall \"true\";");
  EXPECT_NE(input_error([&] { read_mesh(folder.path / "a.geo"); }).find("--trust"), std::string::npos);
  ReadOptions options;
  options.trust = true;
  EXPECT_EQ(input_error([&] { read_mesh(folder.path / "a.geo", options); }).find("--trust"), std::string::npos);
}

}  // namespace
}  // namespace flexboom::testing
