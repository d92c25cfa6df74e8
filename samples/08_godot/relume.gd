# SPDX-License-Identifier: MIT
# Relume for a game of Godot's: what to copy. Each frame Godot draws the surfels as points, lit by its own lights and
# shadows; relight_server makes light of that; textures take it.
extends Node

const ROW := 512  # surfels a row of their picture
const RECEIVERS := 256  # receivers a row of their texture

var error := ""
var scene_hash := ""
var light_map := ImageTexture.new()
var receivers := ImageTexture.new()
var material := ShaderMaterial.new()  # of the surfels

var _server := StreamPeerTCP.new()
var _map_size := Vector2()
var _surfels := 0
var _viewport := Viewport.new()

func open(port: int) -> bool:
	if _server.connect_to_host("127.0.0.1", port) != OK:
		return _fail("no relight_server on port %d" % port)
	while _server.get_status() == StreamPeerTCP.STATUS_CONNECTING:
		OS.delay_msec(1)
	if _server.get_status() != StreamPeerTCP.STATUS_CONNECTED:
		return _fail("no relight_server on port %d" % port)
	_server.set_no_delay(true)
	scene_hash = _server.get_string(16)
	_map_size = Vector2(_server.get_u32(), _server.get_u32())
	_surfels = _server.get_u32()
	return true

func _fail(text: String) -> bool:
	error = text
	return false

# The surfels as points, drawn by a camera that has the whole level in view: Godot's sun has no shadows elsewhere.
func add_surfels(bounds: AABB) -> void:
	var data := StreamPeerBuffer.new()
	data.data_array = _server.get_data(24 * _surfels)[1]
	var rows := (_surfels + ROW - 1) / ROW
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	var vertices := PoolVector3Array()
	var normals := PoolVector3Array()
	var places := PoolVector2Array()
	for i in _surfels:
		vertices.append(Vector3(data.get_float(), data.get_float(), data.get_float()))
		normals.append(Vector3(data.get_float(), data.get_float(), data.get_float()))
		places.append(Vector2((i % ROW + 0.5) / ROW, (i / ROW + 0.5) / rows))
	arrays[Mesh.ARRAY_VERTEX] = vertices
	arrays[Mesh.ARRAY_NORMAL] = normals
	arrays[Mesh.ARRAY_TEX_UV] = places
	var points := MeshInstance.new()
	points.mesh = ArrayMesh.new()
	points.mesh.add_surface_from_arrays(Mesh.PRIMITIVE_POINTS, arrays, [], 0)
	material.shader = load("res://surfels.shader")
	points.material_override = material
	points.cast_shadow = GeometryInstance.SHADOW_CASTING_SETTING_OFF
	points.layers = 2

	var camera := Camera.new()
	var size := bounds.size.length() + 0.2
	camera.set_orthogonal(size, 0.05, size)
	camera.transform = Transform(Basis(), bounds.position + 0.5 * bounds.size + Vector3(0, 0, 0.5 * size))
	camera.cull_mask = 2
	_viewport.size = Vector2(ROW, rows)
	_viewport.usage = Viewport.USAGE_3D
	_viewport.hdr = true
	_viewport.keep_3d_linear = true
	_viewport.shadow_atlas_size = 4096  # 0 by default: no lamp would cast shadows
	_viewport.set_shadow_atlas_quadrant_subdiv(0, Viewport.SHADOW_ATLAS_QUADRANT_SUBDIV_1)
	_viewport.render_target_update_mode = Viewport.UPDATE_ALWAYS
	_viewport.add_child(points)
	_viewport.add_child(camera)
	add_child(_viewport)
	camera.current = true

# Each frame, after Godot has drawn it. places: positions and normals of all that the grid lights.
func update(places: Array) -> bool:
	var image := _viewport.get_texture().get_data()
	image.convert(Image.FORMAT_RGBAF)
	var frame := StreamPeerBuffer.new()
	frame.put_u32(places.size())
	frame.put_data(image.get_data().subarray(0, 16 * _surfels - 1))
	for place in places:
		for v in place:
			frame.put_float(v.x)
			frame.put_float(v.y)
			frame.put_float(v.z)
	_server.put_data(frame.data_array)
	var map := _server.get_data(int(8 * _map_size.x * _map_size.y))
	var light := _server.get_data(16 * places.size())
	if map[0] != OK or light[0] != OK:
		return _fail("relight_server is gone")
	image = Image.new()
	image.create_from_data(int(_map_size.x), int(_map_size.y), false, Image.FORMAT_RGBAH, map[1])
	light_map.create_from_image(image, Texture.FLAG_FILTER)
	var rows := (places.size() + RECEIVERS - 1) / RECEIVERS
	var texels: PoolByteArray = light[1]
	texels.resize(16 * rows * RECEIVERS)
	image = Image.new()
	image.create_from_data(RECEIVERS, rows, false, Image.FORMAT_RGBAF, texels)
	receivers.create_from_image(image, 0)
	return true
