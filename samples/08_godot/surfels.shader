// SPDX-License-Identifier: MIT
// Surfels as points, each on a texel of its own at UV, whose colour is its irradiance [W/m²].
shader_type spatial;
render_mode cull_disabled, depth_test_disable, ambient_light_disabled, specular_disabled;

uniform vec3 lamp_position;
varying vec3 lamp_way;

void vertex() {
	lamp_way = (INV_CAMERA_MATRIX * vec4(lamp_position - (WORLD_MATRIX * vec4(VERTEX, 1.0)).xyz, 0.0)).xyz;
	POSITION = vec4(2.0 * UV - 1.0, 0.0, 1.0);
	POINT_SIZE = 1.0;
}

void fragment() {
	ALBEDO = vec3(1.0);
}

void light() {
	float d2 = dot(lamp_way, lamp_way);
	float falloff = dot(LIGHT, lamp_way * inversesqrt(d2)) > 0.9999 ? 1.0 / d2 : 1.0;
	DIFFUSE_LIGHT += falloff * clamp(dot(NORMAL, LIGHT), 0.0, 1.0) * ATTENUATION * LIGHT_COLOR;
}
