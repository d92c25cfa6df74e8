// SPDX-License-Identifier: MIT
// The level and what moves: Godot's lights and shadows, and Relume's light. UV2 is the place on the light map; COLOR.rg
// that of the back, COLOR.b the receiver of what is lit by the grid. Vertices on no map are at (1, 1). main.gd makes the
// shader of one-sided materials of it.
shader_type spatial;
render_mode cull_disabled, ambient_light_disabled, specular_disabled;

uniform sampler2D image : hint_albedo;
uniform vec4 color = vec4(1.0);  // linear: no hint
uniform vec3 emission = vec3(0.0);
uniform float cutoff = 0.0;
uniform sampler2D light_map : hint_black;  // [W/m²]
uniform sampler2D receivers : hint_black;  // [W/m²] by COLOR.b: the front's, then the back's
uniform vec3 lamp_position;
uniform vec3 show = vec3(1.0, 1.0, 0.0);  // factors on direct and indirect light; z: 1 = irradiance / pi alone

varying vec3 lamp_way;
varying vec3 front_light;
varying vec3 back_light;

vec3 receiver(sampler2D texels, int i) { return texelFetch(texels, ivec2(i % 256, i / 256), 0).rgb; }

void vertex() {
	vec3 world_position = (WORLD_MATRIX * vec4(VERTEX, 1.0)).xyz;
	int i = 2 * int(COLOR.b + 0.5);
	front_light = COLOR.b < 0.0 ? vec3(0.0) : receiver(receivers, i);
	back_light = COLOR.b < 0.0 ? vec3(0.0) : receiver(receivers, i + 1);
	lamp_way = (INV_CAMERA_MATRIX * vec4(lamp_position - world_position, 0.0)).xyz;
}

void fragment() {
	vec4 albedo = color * texture(image, UV);
	if (albedo.a < cutoff) discard;  // what writes ALPHA casts no shadow here
	vec2 place = FRONT_FACING ? UV2 : COLOR.rg;
	vec3 light = FRONT_FACING ? front_light : back_light;
	if (min(place.x, place.y) < 0.99999) light = texture(light_map, place).rgb;
	ALBEDO = show.z > 0.0 ? vec3(1.0) : albedo.rgb;
	EMISSION = ALBEDO * show.y * light / 3.14159265 + (1.0 - show.z) * emission;
}

void light() {
	// Godot's lamps do not fall off by the square of the distance: attenuation 0, and here it is
	float d2 = dot(lamp_way, lamp_way);
	float falloff = dot(LIGHT, lamp_way * inversesqrt(d2)) > 0.9999 ? 1.0 / d2 : 1.0;
	DIFFUSE_LIGHT += show.x * falloff * clamp(dot(NORMAL, LIGHT), 0.0, 1.0) * ATTENUATION * LIGHT_COLOR * ALBEDO / 3.14159265;
}
