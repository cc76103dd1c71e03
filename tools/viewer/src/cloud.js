// Points of the cloud beside the mesh.

import { Box3, Matrix4 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { points, pointSize, pointStyle } from './material.js';

/** From y upwards, as in glTF, to z upwards. */
const TURN = new Matrix4().set( 1, 0, 0, 0, 0, 0, - 1, 0, 0, 1, 0, 0, 0, 0, 0, 1 );

export class Cloud {

	/** `changed` is called when another picture is to be drawn. */
	constructor( changed ) {

		this.changed = changed;
		this.on = true;
		/** Diameter of a point in pixels. */
		this.size = 2;
		this.color = 'color';
		/** Bytes that have come, and all of them; null if nothing is on its way. */
		this.loading = null;

	}

	/** Loads the points of a part. */
	async load( part ) {

		const root = new URL( part.path, location.href.split( '#' )[ 0 ] );
		this.loading = { done: 0, total: 0 };
		try {

			const response = await fetch( new URL( 'tileset.json', root ) );
			if ( ! response.ok ) throw new Error( response.statusText );
			const tileset = await response.json();
			const url = new URL( tileset.root.content.uri, root ).href;
			const loaded = await new GLTFLoader().loadAsync( url, ( { loaded, total } ) => this.loading = { done: loaded, total } );
			this.#place( loaded.scene, part.matrix );
			this.info = { points: this.object.geometry.attributes.position.count, ...tileset.extras?.outcrop, name: part.name };

		} finally {

			this.loading = null;

		}

		return this.object;

	}

	#place( scene, matrix ) {

		scene.updateMatrixWorld( true );
		const object = this.object = scene.getObjectByProperty( 'isPoints', true );
		object.material.dispose();
		this.hasColors = Boolean( object.geometry.attributes.color );
		object.material = points( this.hasColors );
		object.raycast = () => {};
		object.frustumCulled = false;
		object.removeFromParent();
		object.matrixAutoUpdate = false;
		object.matrix.multiplyMatrices( TURN, object.matrixWorld );
		if ( matrix ) object.matrix.premultiply( new Matrix4().fromArray( matrix ) );
		object.updateMatrixWorld( true );
		this.box = new Box3().setFromBufferAttribute( object.geometry.attributes.position ).applyMatrix4( object.matrix );
		if ( ! this.hasColors ) this.color = 'plain';

	}

	/** Brings the picture up to date; `ratio` is the pixels of the picture in one of the screen. */
	apply( ratio ) {

		if ( ! this.object ) return;
		this.object.visible = this.on;
		pointSize.value = this.size * ratio;
		pointStyle.value = Number( this.color === 'color' );

	}

	set( settings ) {

		Object.assign( this, settings );
		this.changed();

	}

}
