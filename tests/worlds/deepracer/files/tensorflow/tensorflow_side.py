"""The other side of `test_against_tensorflow.py`: a script for a Python that has TensorFlow and none of racecraft.

train KIND NETWORK FOLDER SENSORS   build AWS's network as Coach does, save it, freeze it, answer about seen.npz
answer FOLDER OUTPUT                import model.pb, answer about seen.npz
read FOLDER                         read x.ckpt into x.npz

seen.npz holds arrays by sensor, as a graph is fed; SENSORS are names with commas between.
"""

import sys
from pathlib import Path

import numpy as np

NETWORKS = {
    "shallow": ([(32, 8, 4), (64, 4, 2), (64, 3, 1)], [], [512]),
    "tiny": ([(2, 24, 16), (3, 3, 2)], [4], [6]),
    "deep": ([(32, 8, 4), (32, 4, 2), (64, 4, 2), (64, 3, 1)], [512, 512], [256, 128]),
}
LIDAR_UNITS = [256, 256]


def weights(shape, name):
    scale = np.sqrt(2.0 / np.prod(shape[:-1]))
    return v1.get_variable(name, shape, initializer=v1.random_normal_initializer(stddev=scale, seed=len(name)))


def convolution(x, filters, size, stride, name):
    with v1.variable_scope(name):
        kernel, bias = weights((size, size, x.shape[-1], filters), "kernel"), weights((filters,), "bias")
        maps = tf.nn.conv2d(x, kernel, [1, stride, stride, 1], "VALID", name="Conv2D")
        return tf.nn.bias_add(maps, bias, name="BiasAdd")


def dense(x, units, name, activation=None):
    with v1.variable_scope(name):
        kernel, bias = weights((x.shape[-1], units), "kernel"), weights((units,), "bias")
        product = tf.matmul(x, kernel) if len(x.shape) == 2 else tf.tensordot(x, kernel, [[len(x.shape) - 1], [0]])
        y = tf.nn.bias_add(product, bias, name="BiasAdd")
        return activation(y) if activation else y


def flat(x):
    rows = tf.shape(x)[0]
    return tf.reshape(x, tf.stack([rows, int(np.prod(x.shape[1:]))]))


def embedded(name, seen, convolutions, image_units):
    """A sensor by itself: divided by its scale, layered, flattened last."""
    is_image = len(seen.shape) == 4
    with v1.variable_scope(name):
        x, number = seen / (255.0 if is_image else 1.0) - 0.0, 0
        for filters, size, stride in convolutions if is_image else []:
            x = tf.nn.relu(convolution(x, filters, size, stride, f"Conv2d_{number}"))
            number += 2
        for units in image_units if is_image else LIDAR_UNITS:
            x, number = tf.nn.relu(dense(x, units, f"Dense_{number}")), number + 2
        return flat(x)


def body(seen, convolutions, image_units, middle):
    parts = [embedded(name, seen[name], convolutions, image_units) for name in sorted(seen)]
    x = parts[0] if len(parts) == 1 else tf.concat(parts, axis=-1, name="merger")
    with v1.variable_scope("middleware_fc_embedder"):
        for number, units in enumerate(middle):
            x = tf.nn.relu(dense(x, units, f"Dense_{2 * number}"))
    rescaler = v1.get_variable("gradients_from_head_0-0_rescalers", initializer=1.0)
    return ((1 - rescaler) * tf.stop_gradient([x]) + rescaler * [x])[0]


def train(kind, network, folder, sensors):
    layers, fed = NETWORKS[network], np.load(folder / "seen.npz")
    shapes = {name: [None, *fed[name].shape[1:]] for name in sensors.split(",")}
    scopes = ["main_level/agent/policy/online"] if kind == "sac" else ["main_level/agent/main/online"]
    if kind != "sac":
        scopes.append("main_level/agent/main/target")
    seen, asked = None, {}
    for scope in scopes:
        with v1.variable_scope(scope, use_resource=kind == "continuous"):
            seen, output = networks(kind, layers, scope, seen, shapes)
            asked = asked or seen
    output = f"{scopes[0]}/{'network_0/sac_policy_head_0' if kind == 'sac' else 'network_1/ppo_head_0'}/policy"
    with v1.Session() as session:
        session.run(v1.global_variables_initializer())
        online = [variable for variable in v1.global_variables() if "/target/" not in variable.name]
        v1.train.Saver(online).save(session, str(folder / "3_Step-700.ckpt"), write_state=False)
        np.save(folder / "answers.npy", session.run(f"{output}:0", {asked[name]: fed[name] for name in asked}))
        frozen = v1.graph_util.convert_variables_to_constants(session, session.graph_def, [output])
        (folder / "model_3.pb").write_bytes(frozen.SerializeToString())


def networks(kind, layers, scope, seen, shapes):
    output = None
    for number in range(1 if kind == "sac" else 2):
        with v1.variable_scope(f"network_{number}"):
            if number == 0:
                seen = {
                    name: v1.placeholder(tf.float32, shape, name=f"{name}/{name}") for name, shape in shapes.items()
                }
            x = body(seen, *layers)
            if kind == "sac":
                with v1.variable_scope("sac_policy_head_0"):
                    x = dense(x, 256, "dense", tf.nn.relu)
                    output = tf.identity(dense(x, 2, "policy_mean"), name="policy")
                    dense(x, 2, "dense_1")
            elif number == 0:
                with v1.variable_scope("v_values_head_0"):
                    dense(x, 1, "output")
            else:
                with v1.variable_scope("ppo_head_0"):
                    output = ppo_head(kind, x)
    return seen, output


def ppo_head(kind, x):
    if kind == "discrete":
        return tf.nn.softmax(dense(x, 5, "policy_fc"), name="policy")
    v1.get_variable("policy_log_std", initializer=np.array([[-0.5, -1.0]], np.float32))
    return tf.identity(dense(x, 2, "policy_mean"), name="policy")


def answer(folder, output):
    definition = v1.GraphDef()
    definition.ParseFromString((folder / "model.pb").read_bytes())
    v1.import_graph_def(definition, name="")
    seen = np.load(folder / "seen.npz")
    fed = {f"{node.name}:0": seen[node.name.rpartition("/")[2]] for node in definition.node if node.op == "Placeholder"}
    with v1.Session() as session:
        np.save(folder / "answers.npy", session.run(f"{output}:0", fed))


def read(folder):
    reader = tf.train.load_checkpoint(str(folder / "x.ckpt"))
    np.savez(folder / "x.npz", **{name: reader.get_tensor(name) for name in reader.get_variable_to_shape_map()})


if __name__ == "__main__":
    import tensorflow as tf

    v1 = tf.compat.v1
    v1.disable_eager_execution()
    verb, *words = sys.argv[1:]
    {"train": train, "answer": answer, "read": read}[verb](
        *[Path(word) if "/" in word and Path(word).is_dir() else word for word in words]
    )
