local miro = Proto("miro", "Mirotwin radio")

local fields = {
  robots = ProtoField.uint8("miro.robots", "Robots in the network"),
  type = ProtoField.uint8("miro.type", "Type", base.DEC, TYPES, 256 - SEQ_MODULUS),
  seq = ProtoField.uint8("miro.seq", "Sequence number", base.DEC, nil, SEQ_MODULUS - 1),
  crc = ProtoField.uint16("miro.crc", "CRC", base.HEX),
  crc_calculated = ProtoField.uint16("miro.crc.calculated", "CRC calculated", base.HEX),
  crc_status = ProtoField.uint8("miro.crc.status", "CRC status", base.DEC, { [0] = "Bad", [1] = "Good" }),
  damage = ProtoField.string("miro.damage", "Damage"),
}

local function keep(field)
  fields[#fields + 1] = field
  return field
end

-- Gives each field of a payload its ProtoField, miro.PREFIX.NAME.
local function kept(prefix, list)
  local found = {}
  for place, row in ipairs(list) do
    local field = ProtoField[row.kind]("miro." .. prefix .. "." .. row.name, row.label)
    found[place] = { size = row.size, field = keep(field) }
  end
  return found
end

local VELOCITIES = {}
for slot = 0, math.max(ROBOT_COUNTS[1], ROBOT_COUNTS[2]) - 1 do
  VELOCITIES[slot + 1] = kept("slot" .. slot, VELOCITY)
end
SERVICE = kept("service", SERVICE)
for _, opcode in pairs(OPCODES) do opcode.fields = kept("service", opcode.fields) end
local parts = { keep(ProtoField.uint8("miro.telemetry.slot", "slot", base.DEC, nil, SLOT_MASK)) }
for _, flag in ipairs(FLAGS) do
  parts[#parts + 1] = keep(ProtoField.bool("miro.telemetry." .. flag.name, flag.label, 8, nil, flag.mask))
end
local first = table.remove(TELEMETRY, 1)
TELEMETRY = kept("telemetry", TELEMETRY)
table.insert(TELEMETRY, 1, { size = first.size, parts = parts })
miro.fields = fields

local damaged = ProtoExpert.new("miro.damaged", "Damaged", expert.group.CHECKSUM, expert.severity.WARN)
local unknown_content = ProtoExpert.new("miro.content", "Unknown content", expert.group.PROTOCOL, expert.severity.WARN)
miro.experts = { damaged, unknown_content }
local PAYLOADS

local choices = { { 1, "whatever makes the CRC good", 0 } }
for _, robots in ipairs(ROBOT_COUNTS) do choices[#choices + 1] = { robots, tostring(robots), robots } end
miro.prefs.robots = Pref.enum("Robots in the network", 0, "Decides how long a damaged frame was", choices, false)

local event_type = Field.new("rtacser.eventtype")

local function xor(a, b)
  local result, weight = 0, 1
  while a > 0 or b > 0 do
    result = result + weight * NIBBLE_XOR[a % 16 * 16 + b % 16 + 1]
    a, b, weight = math.floor(a / 16), math.floor(b / 16), weight * 16
  end
  return result
end

-- The register after the bytes of `clear`, which begins after the layout byte.
local function crc_register(register, clear, length)
  for place = 1, length do
    local index = xor(register % 256, clear[place]) % 256
    register = xor(math.floor(register / 256), CRC_TABLE[index + 1])
  end
  return register
end

-- HDR to CRC in clear, of the window whose sync stands at `start` (from 1).
local function clear_bytes(raw, start, format)
  local clear = {}
  for place = 1, format.body + 2 do
    clear[place] = xor(raw:byte(start + #SYNC + place - 1), WHITE[place])
  end
  return clear
end

local function candidates()
  local event = event_type()
  local direction = event and DIRECTIONS[event.value]
  local found = {}
  for _, format in ipairs(FORMATS) do
    local may_be = event == nil or format.direction == direction
    if format.robots > 0 and miro.prefs.robots > 0 and format.robots ~= miro.prefs.robots then may_be = false end
    if may_be then found[#found + 1] = format end
  end
  return found
end

-- The first window from `from` on with a good CRC: start, format, clear bytes.
local function find_frame(raw, from, formats)
  local start = raw:find(SYNC, from, true)
  while start do
    for _, format in ipairs(formats) do
      if start + format.size - 1 <= #raw then
        local clear = clear_bytes(raw, start, format)
        if crc_register(format.register, clear, format.body + 2) == RESIDUE then
          return start, format, clear
        end
      end
    end
    start = raw:find(SYNC, start + 1, true)
  end
end

local function lead_start(raw, head, start, format)
  for place = #format.lead, 1, -1 do
    if start - 1 < head or raw:byte(start - 1) ~= format.lead:byte(place) then return start end
    start = start - 1
  end
  return start
end

local function add_fields(tree, clear, list, offset)
  for _, entry in ipairs(list) do
    if entry.field then
      tree:add_le(entry.field, clear(offset, entry.size))
    end
    for _, part in ipairs(entry.parts or {}) do
      tree:add_le(part, clear(offset, entry.size))
    end
    offset = offset + entry.size
  end
  return offset
end

local function add_velocities(tree, clear, format)
  local offset, texts = 1, {}
  for slot = 0, format.robots - 1 do
    local left, right = clear(offset, 2):le_int(), clear(offset + 2, 2):le_int()
    local branch = tree:add(miro, clear(offset, 4), string.format("slot %d: %+d/%+d", slot, left, right))
    offset = add_fields(branch, clear, VELOCITIES[slot + 1], offset)
    texts[#texts + 1] = string.format("%+d/%+d", left, right)
  end
  return "  " .. table.concat(texts, " ")
end

local function add_service(tree, clear)
  local offset = add_fields(tree, clear, SERVICE, 1)
  local opcode = clear(offset - 1, 1):uint()
  local known = OPCODES[opcode]
  if known == nil then
    tree:add_proto_expert_info(unknown_content, "service opcode " .. opcode .. " is not known")
    return ""
  end
  add_fields(tree, clear, known.fields, offset)
  return string.format(" %s slot=%d", known.name, clear(1, 1):uint())
end

local function add_telemetry(tree, clear)
  add_fields(tree, clear, TELEMETRY, 1)
  return string.format(" slot=%d", clear(1, 1):uint() % (SLOT_MASK + 1))
end

local function add_crc(tree, range, received, calculated)
  tree:add(fields.crc, range, received)
  tree:add(fields.crc_calculated, range, calculated):set_generated()
  tree:add(fields.crc_status, range, received == calculated and 1 or 0):set_generated()
end

local function crc_values(clear, format)
  local register = crc_register(format.register, clear, format.body)
  return clear[format.body + 1] + 256 * clear[format.body + 2], xor(register, XOR_OUT)
end

local function add_frame(tvb, tree, head, start, format, clear)
  local size = start - head + format.size
  local bytes = ByteArray.new()
  bytes:set_size(format.body + 2)
  for place, value in ipairs(clear) do bytes:set_index(place - 1, value) end
  local branch = tree:add(miro, tvb(head - 1, size), "Mirotwin frame, " .. format.name)
  local body = bytes:tvb("Mirotwin frame in clear")
  if format.robots > 0 then
    branch:add(fields.robots, tvb(start - 1, 0), format.robots):set_generated()
  end
  branch:add(fields.type, body(0, 1))
  branch:add(fields.seq, body(0, 1))
  local kind = math.floor(clear[1] / SEQ_MODULUS)
  local text = string.format("%s seq=%d", TYPES[kind], clear[1] % SEQ_MODULUS)
  local add = PAYLOADS[kind]
  if format.types[kind] then
    text = text .. add(branch, body, format)
  else
    branch:add_proto_expert_info(unknown_content, "type " .. kind .. " is not sent in this direction")
  end
  add_crc(branch, body(format.body, 2), crc_values(clear, format))
  branch:append_text(", " .. text)
  return text
end

-- The furthest that a window got which starts in the run: text, and start and format of a bad CRC.
local function judge(raw, head, past, formats)
  local start = raw:find(SYNC, head, true)
  if start == nil or start >= past then return "no sync" end
  for _, format in ipairs(formats) do
    if start + format.size == #raw + 1 then return "bad crc", start, format end
  end
  for _, format in ipairs(formats) do
    if start + format.size <= #raw then return "bad crc", start, format end
  end
  return "cut short"
end

local function add_damage(tvb, tree, raw, head, past, formats)
  local reason, start, format = judge(raw, head, past, formats)
  local range = tvb(head - 1, past - head)
  local branch = tree:add(miro, range, string.format("Damaged: %s, %d bytes", reason, past - head))
  branch:add(fields.damage, range, reason):set_generated()
  if start then
    local from = start - 1 + format.size - 2
    add_crc(branch, tvb(from, 2), crc_values(clear_bytes(raw, start, format), format))
  end
  branch:add_proto_expert_info(damaged, reason)
  return string.format("damaged (%s, %d bytes)", reason, past - head)
end

function miro.dissector(tvb, pinfo, tree)
  local raw, formats = tvb:raw(), candidates()
  local head, texts = 1, {}
  while head <= #raw do
    local start, format, clear = find_frame(raw, head, formats)
    local begin = start and lead_start(raw, head, start, format) or #raw + 1
    if begin > head then
      texts[#texts + 1] = add_damage(tvb, tree, raw, head, begin, formats)
    end
    if not start then break end
    texts[#texts + 1] = add_frame(tvb, tree, begin, start, format, clear)
    head = start + format.size
  end
  pinfo.cols.protocol:set("Miro")
  pinfo.cols.info:set(table.concat(texts, "; "))
  return tvb:len()
end

PAYLOADS = {
  team = add_velocities, service = add_service, telemetry = add_telemetry, team_ask = add_velocities,
}
for kind, name in pairs(TYPES) do PAYLOADS[kind] = PAYLOADS[name] end

DissectorTable.get("rtacser.data"):add_for_decode_as(miro)
