# SPDX-License-Identifier: MIT
# Rays against a scene, and the walks that find which surfaces matter.
find_package(embree 3.13 REQUIRED)

relume_room(relume_rays ray_tracer.cpp build_rays.cpp ray_overlaps.cpp)
target_link_libraries(relume_rays PUBLIC relume_scene PRIVATE embree)

relume_room(relume_play_space play_space.cpp find_starts.cpp seen_cells.cpp keep_cells.cpp)
target_link_libraries(relume_play_space PUBLIC relume_rays)
