# SPDX-License-Identifier: MIT
# What differs between two bakes: relume_compare, for the command line and the tests.
find_package(nlohmann_json REQUIRED)
relume_room(relume_compare compare_scene.cpp staleness.cpp fit_bake.cpp compare_places.cpp compare_lightings.cpp compare_light.cpp place_receivers.cpp
                           compare_receivers.cpp compare_report.cpp
                           compare_text.cpp compare_pictures.cpp compare_page.cpp)
target_link_libraries(relume_compare PUBLIC relume::bake relume_json relume::runtime relume_image_io relume_frame nlohmann_json::nlohmann_json)
