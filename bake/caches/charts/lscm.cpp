// SPDX-License-Identifier: MIT
// See lscm.h. The only file of the baker's light map that includes CGAL.
#include "bake/caches/charts/lscm.h"

#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_parameterization/Error_code.h>
#include <CGAL/Surface_mesh_parameterization/LSCM_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/Two_vertices_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/parameterize.h>

#include <algorithm>
#include <cmath>
#include <exception>

namespace relume {
namespace {

namespace Smp = CGAL::Surface_mesh_parameterization;
using Kernel = CGAL::Simple_cartesian<double>;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

// The faces as a halfedge mesh; false when they are not a manifold with consistent winding.
bool makeSurface(const Mesh& mesh, const FaceGraph& graph, std::span<const std::uint32_t> faces, float scale,
                 std::vector<std::uint32_t>& vertices, Surface& surface) {
  for (const std::uint32_t f : faces) {
    for (int k = 0; k < 3; ++k) vertices.push_back(graph.vertex[f][k]);
  }
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  const glm::vec3 origin = mesh.position[vertices.front()];
  for (const std::uint32_t v : vertices) {
    const glm::dvec3 p = glm::dvec3(mesh.position[v] - origin) * static_cast<double>(scale);
    surface.add_vertex(Kernel::Point_3(p.x, p.y, p.z));
  }
  for (const std::uint32_t f : faces) {
    std::array<Surface::Vertex_index, 3> corner;
    for (int k = 0; k < 3; ++k) {
      const auto at = std::lower_bound(vertices.begin(), vertices.end(), graph.vertex[f][k]) - vertices.begin();
      corner[static_cast<std::size_t>(k)] = Surface::Vertex_index(static_cast<Surface::size_type>(at));
    }
    if (surface.add_face(corner[0], corner[1], corner[2]) == Surface::null_face()) return false;
  }
  return true;
}

}  // namespace

std::optional<Chart> mapConformal(const Mesh& mesh, const FaceGraph& graph, std::span<const std::uint32_t> faces,
                                  float scale) {
  try {
    Surface surface;
    std::vector<std::uint32_t> vertices;
    if (!makeSurface(mesh, graph, faces, scale, vertices, surface)) return std::nullopt;
    const auto border = CGAL::Polygon_mesh_processing::longest_border(surface).first;
    if (border == Surface::null_halfedge()) return std::nullopt;

    auto uv = surface.add_property_map<Surface::Vertex_index, Kernel::Point_2>("v:uv").first;
    using Parameterizer = Smp::LSCM_parameterizer_3<Surface>;
    if (Smp::parameterize(surface, Parameterizer(), border, uv) != Smp::OK) return std::nullopt;

    double areaUv = 0.0, areaSurface = 0.0;
    Chart chart;
    chart.triangle.assign(faces.begin(), faces.end());
    std::vector<std::array<glm::dvec2, 3>> corners(faces.size());
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at =
            std::lower_bound(vertices.begin(), vertices.end(), graph.vertex[faces[i]][static_cast<int>(k)]) -
            vertices.begin();
        const Kernel::Point_2& p = uv[Surface::Vertex_index(static_cast<Surface::size_type>(at))];
        if (!std::isfinite(p.x()) || !std::isfinite(p.y())) return std::nullopt;
        corners[i][k] = {p.x(), p.y()};
      }
      const glm::dvec2 a = corners[i][1] - corners[i][0], b = corners[i][2] - corners[i][0];
      areaUv += 0.5 * (a.x * b.y - a.y * b.x);
      areaSurface += static_cast<double>(graph.area[faces[i]]) * scale * scale;
    }
    if (!(areaUv > 0.0)) return std::nullopt;
    const double grow = std::sqrt(areaSurface / areaUv);
    for (const auto& t : corners) {
      chart.uv.push_back({glm::vec2(t[0] * grow), glm::vec2(t[1] * grow), glm::vec2(t[2] * grow)});
    }
    chart.areaUv = chart.areaSurface = static_cast<float>(areaSurface);
    return chart;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace relume
