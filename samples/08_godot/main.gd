# SPDX-License-Identifier: MIT
# A level in Godot 3: its lights, its shadows and things that move, with Relume's indirect light. play.sh runs it.
#   --level=FILE.glb --port=N [--screenshot=OUT.png] [--frames=N] [--show=all|direct|indirect] [--still]
# Ends with 0, 1 (usage), 2 (a file that cannot be read or written), 3 (the level's, or bake and level do not belong
# together), 4 (no server) or 5 (no OpenGL ES 3.0, or an extension that the level requires).
extends Spatial

const SHADER := preload("res://surface.shader")
const Level := preload("res://level.gd")
const Relume := preload("res://relume.gd")
const SHOWS := {"all": Vector3(1, 1, 0), "direct": Vector3(1, 0, 1), "indirect": Vector3(0, 1, 1)}  # as surface.shader has it

var level := Level.new()
var relume := Relume.new()
var options := {"--level": "", "--port": "", "--screenshot": "", "--frames": "0", "--show": "all"}
var one_sided := Shader.new()
var materials := []
var sun := DirectionalLight.new()
var lamp := OmniLight.new()
var moving := []     # MeshInstance
var first_moving := 0  # of the receivers
var frame := 0

func _ready() -> void:
	var is_known := true  # Godot's own options have no "="
	for argument in OS.get_cmdline_args():
		var parts: Array = argument.split("=")
		if parts.size() == 2:
			is_known = is_known and parts[0] in options
			options[parts[0]] = parts[1]
		elif argument == "--still":
			options[argument] = true
	if not is_known or options["--level"] == "" or not options["--frames"].is_valid_integer() or not options["--show"] in SHOWS:
		return end(1, "usage: --level=FILE.glb --port=N [--screenshot=OUT.png] [--frames=N] [--show=all|direct|indirect] [--still]")
	if OS.get_current_video_driver() != OS.VIDEO_DRIVER_GLES3:
		return end(5, "OpenGL ES 3.0 is needed: GLES2 has no float viewports and reads no texels by number")
	if not relume.open(int(options["--port"])):
		return end(4, relume.error)
	if not level.read(options["--level"]):
		return end(level.code, level.error)
	if level.scene_hash != relume.scene_hash:
		return end(3, "the bake is not the one that %s was exported with" % options["--level"])
	add_level()
	add_lights()
	if not "--still" in options:
		add_moving()
	add_child(relume)
	relume.add_surfels(level.bounds)
	move(0.0)
	while true:
		yield(VisualServer, "frame_post_draw")
		if not step():
			return

func end(code: int, text: String) -> void:
	if code != 0:
		printerr("relume: " + text)
	get_tree().quit(code)

func add_material(parameters: Dictionary, two_sided: bool) -> ShaderMaterial:
	var material := ShaderMaterial.new()
	material.shader = SHADER if two_sided else one_sided
	for name in parameters:
		material.set_shader_param(name, parameters[name])
	material.set_shader_param("light_map", relume.light_map)
	material.set_shader_param("receivers", relume.receivers)
	material.set_shader_param("show", SHOWS[options["--show"]])
	materials.append(material)
	return material

func add_level() -> void:
	one_sided.code = SHADER.code.replace("cull_disabled", "cull_back")
	for surface in level.surfaces:
		var instance := MeshInstance.new()
		instance.mesh = surface["mesh"]
		instance.cast_shadow = GeometryInstance.SHADOW_CASTING_SETTING_DOUBLE_SIDED
		var material: Dictionary = surface["material"] if surface["material"] != null else {}
		var pbr: Dictionary = material.get("pbrMetallicRoughness", {})
		var c: Array = pbr.get("baseColorFactor", [1, 1, 1, 1])
		var e: Array = material.get("emissiveFactor", [0, 0, 0])
		var strength: float = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
		var parameters := {"color": Plane(c[0], c[1], c[2], c[3]), "emission": strength * Vector3(e[0], e[1], e[2])}
		if "baseColorTexture" in pbr:
			parameters["image"] = level.images[int(level._json["textures"][int(pbr["baseColorTexture"]["index"])]["source"])]
		if material.get("alphaMode", "") == "MASK":
			parameters["cutoff"] = material.get("alphaCutoff", 0.5)
		instance.material_override = add_material(parameters, material.get("doubleSided", false))
		add_child(instance)
	var camera := Camera.new()
	camera.set_perspective(level.fov_y, 0.05, 100)
	camera.transform = level.camera
	camera.cull_mask = 1
	add_child(camera)
	camera.current = true
	var environment := Environment.new()
	environment.background_mode = Environment.BG_COLOR
	environment.tonemap_mode = Environment.TONE_MAPPER_ACES if options["--show"] == "all" else Environment.TONE_MAPPER_LINEAR
	camera.environment = environment

# Godot's colours of lights are sRGB, and its energies times pi.
func set_intensity(light: Light, intensity: Color) -> void:
	var top := max(max(intensity.r, intensity.g), max(intensity.b, 1e-6))
	var c := [intensity.r / top, intensity.g / top, intensity.b / top]
	for i in 3:
		c[i] = 12.92 * c[i] if c[i] < 0.0031308 else 1.055 * pow(c[i], 1.0 / 2.4) - 0.055
	light.light_color = Color(c[0], c[1], c[2])
	light.light_energy = top / PI

func add_lights() -> void:
	sun.transform = level.sun["transform"]
	sun.directional_shadow_mode = DirectionalLight.SHADOW_ORTHOGONAL
	sun.directional_shadow_max_distance = level.bounds.size.length() + 1.0
	lamp.transform.origin = level.lamp["transform"].origin
	lamp.omni_range = level.bounds.size.length()
	lamp.omni_attenuation = 0.0
	for light in [sun, lamp]:
		light.layers = 3  # a camera that does not see a lamp's layer takes no light from it, either
		light.shadow_enabled = true
		light.shadow_bias = 0.005 if light == sun else 0.06
		add_child(light)

func add_moving() -> void:
	first_moving = level.receivers.size()
	var ball := SphereMesh.new()
	ball.radial_segments = 24
	ball.rings = 12
	ball.radius = 0.2
	ball.height = 0.4
	var box := CubeMesh.new()
	box.size = Vector3(0.4, 0.4, 0.4)
	var material := add_material({"color": Plane(0.7, 0.7, 0.7, 1)}, false)
	for shape in [ball, box]:
		var arrays: Array = shape.get_mesh_arrays()
		var colors := PoolColorArray()
		var places := PoolVector2Array()
		for i in arrays[Mesh.ARRAY_VERTEX].size():
			colors.append(Color(1, 1, level.receivers.size()))
			places.append(Vector2(1, 1))
			level.receivers.append([Vector3(), Vector3(0, 1, 0)])
		arrays[Mesh.ARRAY_COLOR] = colors
		arrays[Mesh.ARRAY_TEX_UV2] = places
		var instance := MeshInstance.new()
		instance.mesh = ArrayMesh.new()
		instance.mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays, [], 0)
		instance.material_override = material
		add_child(instance)
		moving.append(instance)

# What moves, `seconds` into the game, around a point in front of the camera; and its receivers.
func move(seconds: float) -> void:
	var ahead: Vector3 = level.camera.xform(Vector3(0, 0, -3))
	var at := first_moving
	for i in moving.size():
		var angle: float = 0.5 * seconds + PI * i
		var instance: MeshInstance = moving[i]
		instance.transform = Transform(Basis(Vector3(0.6, 0.8, 0), 1.3 * seconds),
				Vector3(ahead.x + 0.8 * cos(angle), 0.6 + 0.3 * sin(2.0 * angle), ahead.z - 0.8 * sin(angle)))
		var arrays: Array = instance.mesh.surface_get_arrays(0)
		for k in arrays[Mesh.ARRAY_VERTEX].size():
			level.receivers[at] = [instance.transform.xform(arrays[Mesh.ARRAY_VERTEX][k]),
					instance.transform.basis * arrays[Mesh.ARRAY_NORMAL][k]]
			at += 1
	sun.transform.basis = Basis(Vector3(0, 1, 0), 0.3 * sin(0.4 * seconds)) * level.sun["transform"].basis
	set_intensity(sun, level.sun["intensity"])
	set_intensity(lamp, level.lamp["intensity"] * (0.8 + 0.2 * cos(2.3 * seconds)))
	for material in materials + [relume.material]:
		material.set_shader_param("lamp_position", lamp.transform.origin)

# After a frame is drawn: its light for the next one. False at the end.
func step() -> bool:
	frame += 1
	if frame == int(options["--frames"]):
		if options["--screenshot"] != "":
			var image := get_viewport().get_texture().get_data()
			image.flip_y()
			image.convert(Image.FORMAT_RGB8)
			if image.save_png(options["--screenshot"]) != OK:
				end(2, options["--screenshot"] + " could not be written")
				return false
		end(0, "")
		return false
	var places := []
	for receiver in level.receivers:
		places.append(receiver)
		places.append([receiver[0], -receiver[1]])
	if not relume.update(places):
		end(4, relume.error)
		return false
	move(0.0 if "--still" in options else frame / 30.0)
	return true
