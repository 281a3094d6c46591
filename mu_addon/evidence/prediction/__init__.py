"""What the model predicts of each kind of experiment, every effect of the library included."""
