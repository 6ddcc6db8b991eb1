// Meshes points in the unit box by TetGen, and reports one JSON object.
#define TETLIBRARY
#include <tetgen.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "bench/drivers/meter.h"
#include "nlohmann/json.hpp"

namespace {

constexpr int kCorners = 8;
// The faces of the box; corner i is at (i & 1, i >> 1 & 1, i >> 2 & 1).
constexpr std::array<std::array<int, 4>, 6> kFaces = {
    {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};

// The corners and faces of the unit box, and the points. The arrays are TetGen's: it deletes them.
void Fill(const std::vector<double>& points, tetgenio& in) {
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(kCorners + points.size() / 3);
  in.pointlist = new REAL[static_cast<size_t>(in.numberofpoints) * 3];
  for (int i = 0; i < kCorners; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      in.pointlist[3 * i + axis] = (i >> axis) & 1;
    }
  }
  std::copy(points.begin(), points.end(), in.pointlist + 3 * kCorners);
  in.numberoffacets = static_cast<int>(kFaces.size());
  in.facetlist = new tetgenio::facet[kFaces.size()];
  for (size_t face = 0; face < kFaces.size(); ++face) {
    tetgenio::facet& facet = in.facetlist[face];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(facet.polygonlist);
    facet.polygonlist->numberofvertices = 4;
    facet.polygonlist->vertexlist = new int[4];
    std::copy(kFaces[face].begin(), kFaces[face].end(), facet.polygonlist->vertexlist);
  }
}

// Sends text for stdout into a file, as long as it lives.
class Capture {
 public:
  Capture() : stdout_(dup(STDOUT_FILENO)), file_(std::tmpfile()) {
    if (stdout_ < 0 || file_ == nullptr || dup2(fileno(file_), STDOUT_FILENO) < 0) {
      std::perror("bench_tetgen_mesh: cannot capture what TetGen says");
      std::exit(2);
    }
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  ~Capture() {
    std::fflush(stdout);
    dup2(stdout_, STDOUT_FILENO);
    close(stdout_);
    std::fclose(file_);
  }

  // All that was printed so far.
  std::string Text() {
    std::fflush(stdout);
    std::string text;
    std::rewind(file_);
    for (int c = std::fgetc(file_); c != EOF; c = std::fgetc(file_)) {
      text += static_cast<char>(c);
    }
    return text;
  }

 private:
  int stdout_;
  std::FILE* file_;
};

// The number after `label`.
double After(const std::string& text, const std::string& label) {
  const size_t at = text.find(label);
  if (at == std::string::npos) {
    std::cerr << "TetGen did not say \"" << label << "\":\n" << text;
    std::exit(1);
  }
  return std::strtod(text.c_str() + at + label.size(), nullptr);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: bench_tetgen_mesh POINTS SWITCHES\n";
    return 2;
  }
  tetgenio in;
  Fill(wellspace::bench::ReadPoints(argv[1]), in);
  tetgenio out;
  std::string said;
  double wall_seconds = 0;
  uint64_t memory = 0;
  {
    Capture capture;
    const wellspace::bench::Meter meter;
    try {
      tetrahedralize(argv[2], &in, &out);
    } catch (int code) {
      std::cerr << "TetGen gave up with code " << code << ":\n" << capture.Text();
      return 1;
    }
    wall_seconds = meter.WallSeconds();
    memory = meter.PeakBytes();
    said = capture.Text();
  }
  // Its own time is the processor's, and ends before it frees its memory.
  std::cout << nlohmann::json{{"seconds", After(said, "Total running seconds:")},
                              {"wall_seconds", wall_seconds},
                              {"memory_bytes", memory},
                              {"vertices", static_cast<uint64_t>(After(said, "Mesh points:"))},
                              {"simplices", static_cast<uint64_t>(After(said, "Mesh tetrahedra:"))}}
            << '\n';
  return 0;
}
