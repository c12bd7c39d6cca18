"""Parts of ``train_speed``, one for each subject."""
